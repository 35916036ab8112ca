"""Before going out: what recordings that are planned could show, from their information matrices."""
