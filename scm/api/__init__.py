"""The city for people: REST, a live stream and the dashboard, fed only by messages from the bus.

`view` subscribes to the city and stores the newest of everything; `*_rows` make the rows of it;
`app` builds the web application over it from `routes`, one file per noun; `stream` sends live
changes to all pages; `gate` and `problem` guard the edge; `server` runs it; `static` is the page.
"""
