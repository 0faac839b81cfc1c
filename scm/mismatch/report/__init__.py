"""What people see of a diagnosis: a page, the same as JSON, and the car file with what was found.

write       all of it into one folder: `record` makes a `Report` of findings and evidence,
            and every file is written from that
record      the report as one record, worked out once; `report.json`, `drawn.json`
sentences   verdict, where and when, advice; wording: names, numbers, units; panels: first screen
pictures    all SVGs, with drive_pictures and plot
page        `report.html`; car_file: `car.toml` and its own effects
cars_page   the page of several cars
"""
