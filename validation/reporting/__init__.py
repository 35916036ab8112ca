"""What commands leave behind: run folders, scores, figures, pages, progress."""
