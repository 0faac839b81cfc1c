"""Lanes as polylines and routes along them."""
