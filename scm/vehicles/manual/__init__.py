"""The manual of effects: a page and a picture for each, generated from the effects.

`shown.toml` defines what each picture compares, `manoeuvres.py` how it is driven. `term_page.py`
writes the text, `picture.py` simulates both cars and draws, `folder.py` writes all files.
May import the rest of `scm.vehicles`; nothing there imports this folder.
To configure a new effect's picture add it to `shown.toml`; the default shows its prior's edge.
"""
