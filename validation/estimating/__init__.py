"""Spin rates of a recording by every method, with what a reader must know of them: what `discsim estimate` writes."""
