"""Studies: pages and tables of the documentation, each made anew by a command of its own (`discsim study`)."""
