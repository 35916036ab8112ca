"""The paper side by side (docs/paper.md): its equations and our functions, its numbers and figures and ours."""
