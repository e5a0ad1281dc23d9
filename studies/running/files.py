"""The project's files, under their earlier address; ``simgap_files`` is their home."""

from simgap_files import (
    atomic_path,
    atomic_write_bytes,
    atomic_write_json,
    atomic_write_text,
    copy_file,
    jsonable,
    read_json,
    remove_partial_files,
)

__all__ = [
    "atomic_path",
    "atomic_write_bytes",
    "atomic_write_json",
    "atomic_write_text",
    "copy_file",
    "jsonable",
    "read_json",
    "remove_partial_files",
]
