"""The only door to plotting, and the page. Depends on: plain tables and arrays."""
