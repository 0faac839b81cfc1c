"""Scenarios that come with the program, one file each; see `scm.study.scenario`."""
