"""The paper's systems as objects of ``sims.System``; bring yours in the same way."""
