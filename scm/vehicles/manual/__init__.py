"""The manual of effects: a page and a picture for each, written from the effects themselves.

`shown.toml` says what each picture drives and compares, `manoeuvres.py` how it is driven.
`term_page.py` writes the text, `picture.py` drives both cars and draws, `folder.py` writes all.
May import the rest of `scm.vehicles`; nothing there imports this folder.
To show a new effect: add it to `shown.toml`; without one it is shown at its prior's edge.
"""
