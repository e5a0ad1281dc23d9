"""Reports as one self-contained HTML file (``sections``), figures in one style, and tables."""
