"""The parking manager: which car gets which bay, and which one may drive."""
