"""One file per noun of the web interface; each builds its router from the city it is given."""
