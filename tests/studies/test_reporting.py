"""None"""

import base64
import html.parser
import io
import math
import re
import sys

import matplotlib
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from studies.reporting import figures
from studies.reporting import sections as reporting
from studies.reporting.media import encode_gif, load_media
from studies.reporting.render import inline, number, paragraphs

VOID = {"meta", "link", "img", "source", "br", "hr"}


class Page(html.parser.HTMLParser):
    """Collects tags and text, and fails on tags that do not nest."""

    def __init__(self, text):
        super().__init__()
        self.stack, self.tags, self.text = [], [], ""
        self.feed(str(text))
        self.close()
        assert not self.stack, f"left open: {self.stack}"

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack and self.stack.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data):
        if self.stack and self.stack[-1] not in ("style", "title"):
            self.text += data

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def wave():
    t = np.linspace(0, 1, 50)
    return {"measured": (t, np.sin(t)), "nominal": (t, np.cos(t))}


def drawn(series, width=6.4):
    with figures.styled():
        figure, axes = figures.new_figure(width=width)
        figures.draw_lines(axes[0, 0], series)
        axes[0, 0].set(xlabel="time (s)", ylabel="angle (rad)")
        figure.legend(loc="outside upper left", ncols=4)
    return figure


def film():
    frames = [np.full((20, 30, 3), shade, np.uint8) for shade in (0, 120, 240)]
    return encode_gif(frames, seconds_per_frame=0.1)


def full_report():
    figure = drawn(wave())
    return reporting.Report(
        "Pendulum & friends",
        "Two runs of `sims.Pendulum`.",
        [
            reporting.Verdict("Friction <b>found</b>.", "See **below**.", "good", "confirmed"),
            reporting.KeyValues({"error": "0.02 rad", "runs": 4}, style="tiles"),
            reporting.Figure(figure, alt="two curves", caption="Run 3.", heading="Rollouts"),
            reporting.Gallery(
                [reporting.Figure(figures.to_png(figure), alt="as pixels")], heading="More"
            ),
            reporting.Animation(film(), alt="grey grows light", heading="Film"),
            reporting.Table(["name", "a", "b", "c"], [["x", 1.0, None, "<i>"]], heading="Table"),
            reporting.Code("seed: 0 <script>", summary="Config"),
            reporting.Prose("One.\n\n- two\n- three", heading="Words"),
        ],
        footer="Made by `python -m studies.x`.",
    )


def test_page_is_well_formed_and_loads_nothing_from_outside(tmp_path):
    path = full_report().write(tmp_path / "deep" / "report.html")
    text = path.read_text("utf-8")
    page = Page(text)
    for tag, attributes in page.tags:
        for name in ("src", "srcset", "href"):
            if name in attributes and tag != "a":
                assert attributes[name].startswith("data:")
    assert not page.all("script")
    assert "@import" not in text and "url(" not in text.split("</style>")[0]
    (policy,) = [m["content"] for m in page.all("meta") if "http-equiv" in m]
    assert policy.startswith("default-src 'none'")
    assert list(path.parent.iterdir()) == [path]


def test_page_escapes_what_is_not_markup():
    page = Page(full_report().html())
    assert not page.all("b") and not page.all("i")
    assert "Friction <b>found</b>." in page.text
    assert "seed: 0 <script>" in page.text


def test_an_option_is_kept_on_one_line():
    text = str(reporting.Report("Gap", "Give more --minutes.", []).html())
    page = Page(text)
    assert [span for span in page.all("span") if span.get("class") == "option"]
    assert "Give more --minutes." in page.text and ".option { white-space: nowrap; }" in text


def test_headings_are_ordered_and_linked_from_the_contents():
    page = Page(full_report().html())
    assert len(page.all("h1")) == 1
    assert len(page.all("h2")) == 5
    ids = {attributes["id"] for attributes in page.all("section")}
    links = [a["href"] for a in page.all("a") if a["href"].startswith("#")]
    assert len(links) == 5
    assert {link[1:] for link in links} <= ids
    assert all(image["alt"] for image in page.all("img"))


def test_same_report_gives_the_same_bytes():
    assert full_report().html() == full_report().html()


def test_pictures_arrive_whole():
    page = Page(full_report().html())
    kinds = {}
    for image in page.all("img") + page.all("source"):
        address = image.get("src", image.get("srcset"))
        kind, data = re.fullmatch(r"data:([a-z/+]+);base64,(.+)", address).groups()
        kinds.setdefault(kind, []).append(base64.b64decode(data, validate=True))
    assert set(kinds) == {"image/svg+xml", "image/png", "image/gif"}
    for data in kinds["image/png"] + kinds["image/gif"]:
        Image.open(io.BytesIO(data)).load()
    assert all(b"prefers-color-scheme: dark" in data for data in kinds["image/svg+xml"])


def test_figure_is_laid_out_anew_for_a_phone_and_keeps_its_size():
    figure = drawn(wave())
    section = reporting.Figure(figure, alt="x")
    narrow, wide = (
        float(re.search(rb'<svg[^>]* width="([\d.]+)pt"', picture.data)[1])
        for picture in (section.narrow_picture, section.picture)
    )
    assert narrow < 0.7 * wide
    assert figure.get_size_inches().tolist() == [6.4, 3.2]


def test_figure_that_does_not_fit_a_phone_is_not_cut():
    names = {f"a rather long name of a curve, number {n}": c for n, c in enumerate(wave().values())}
    figure = drawn(names, width=8)
    assert reporting.Figure(figure, alt="x").narrow_picture is None
    side_by_side, _ = figures.new_figure(1, 2)
    assert reporting.Figure(side_by_side, alt="x").narrow_picture is None


def test_animation_has_a_still_for_readers_who_want_less_motion():
    page = Page(reporting.Animation(film(), alt="grey").html())
    (source,) = page.all("source")
    assert source["media"] == "(prefers-reduced-motion: reduce)"
    middle = base64.b64decode(source["srcset"].split(",")[1])
    assert Image.open(io.BytesIO(middle)).getpixel((0, 0)) == pytest.approx((120,) * 3, abs=8)


def test_gif_repeats_for_ever_at_the_speed_asked_for():
    with Image.open(io.BytesIO(film())) as gif:
        assert gif.n_frames == 3
        assert gif.info["duration"] == 100
        assert gif.info["loop"] == 0


def test_media_of_unknown_kind_is_refused(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("words")
    with pytest.raises(ValueError, match=r"notes\.txt is none of PNG"):
        load_media(path)
    with pytest.raises(ValueError, match="no frames"):
        encode_gif([], 0.1)


def test_table_of_uneven_rows_is_refused():
    with pytest.raises(ValueError, match="row 1 of the table has 1 cells, expected 2"):
        reporting.Table(["a", "b"], [[1, 2], [1]])


def test_wide_tables_turn_to_cards_and_name_each_cell():
    wide = Page(reporting.Table(["n", "a", "b", "c"], [["x", 1.5, 2, "y"]]).html())
    assert wide.all("table")[0]["class"] == "cards"
    assert [cell["data-label"] for cell in wide.all("td")] == ["a", "b", "c"]
    narrow = Page(reporting.Table(["n", "a"], [["x", 1.5]]).html())
    assert "class" not in narrow.all("table")[0]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (math.nan, "–"),
        (True, "yes"),
        (0.0, "0"),
        (-0.5, "\u22120.500"),
        (9.996, "10.0"),
        (123.4, "123"),
        (0.00123, "0.00123"),
        (1.23e-8, "1.23\u202f×\u202f10⁻⁸"),
        (12345, "12\u2009345"),
        (-math.inf, "\u2212∞"),
        ("as is", "as is"),
    ],
)
def test_numbers_are_shown_as_people_write_them(value, text):
    assert number(value) == text


@given(st.floats(1e-3, 1e5))
def test_shown_number_is_right_to_its_digits(value):
    assert float(number(value, 4)) == pytest.approx(value, rel=5.01e-4)


@settings(max_examples=200)
@given(st.text())
def test_any_text_gives_well_formed_html_without_tags_of_its_own(text):
    for filter_ in (inline, paragraphs):
        page = Page(f"<div>{filter_(text)}</div>")
        own = {"div", "p", "ul", "li", "strong", "code", "a", "span"}
        assert {tag for tag, _ in page.tags} <= own
        assert all(span == {"class": "option"} for span in page.all("span"))


def test_links_lead_to_web_pages_only():
    assert 'href="https://x.org/a?b=1&amp;c=2"' in inline("[x](https://x.org/a?b=1&c=2)")
    assert "<a" not in inline("[x](javascript:alert(1))")
    assert inline("`[a](https://x.org) **b**`") == "<code>[a](https://x.org) **b**</code>"


def test_saved_figure_has_its_numbers_beside_it(tmp_path):
    series = {"short": ([0.0, 1.0], [0.1, 1 / 3]), "long": ([0.0, 1.0, 2.0], [1.0, 2.0, 3.0])}
    columns = {
        f"{name} {c}": v for name, xy in series.items() for c, v in zip("xy", xy, strict=False)
    }
    figure = drawn(series)
    path = tmp_path / "a" / "curve.png"
    figures.save_figure(figure, path, columns)
    with Image.open(path) as image:
        assert image.size[0] > 1000
    table = pd.read_csv(path.with_suffix(".csv"))
    assert list(table) == ["short x", "short y", "long x", "long y"]
    np.testing.assert_array_equal(table["short y"], [0.1, 1 / 3, np.nan])
    assert sorted(file.name for file in path.parent.iterdir()) == ["curve.csv", "curve.png"]
    with pytest.raises(ValueError, match=r"should end in \.png"):
        figures.save_figure(figure, tmp_path / "curve.pdf", {})


def test_drawing_leaves_no_global_state_behind():
    before = dict(matplotlib.rcParams)
    drawn(wave())
    assert dict(matplotlib.rcParams) == before
    if "matplotlib.pyplot" in sys.modules:
        assert not sys.modules["matplotlib.pyplot"].get_fignums()


def test_a_hyphen_before_a_number_is_a_minus_and_none_in_an_address():
    assert (
        inline("-1.5 \u00b1 2 (-3, **-0.5**)")
        == "\u22121.5 \u00b1 2 (\u22123, <strong>\u22120.5</strong>)"
    )
    for kept in ("2026-11-23", "1e-05", "arm-3", "`-1`"):
        assert "\u2212" not in inline(kept)
    assert 'href="https://x.org/?a=-1"' in inline("[x](https://x.org/?a=-1)")
