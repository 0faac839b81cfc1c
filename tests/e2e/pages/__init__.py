"""Pages of the dashboard over a real city; one city and one browser for the package."""
