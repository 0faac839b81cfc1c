"""The city for people: REST, a live stream and the dashboard, fed only by messages from the bus.

`view` hears the city and keeps the newest of everything; `*_rows` turn that into what is shown;
`app` builds the web application over it from `routes`, one file per noun; `stream` sends live
changes to all pages; `gate` and `problem` guard the edge; `server` runs it; `static` is the page.
"""
