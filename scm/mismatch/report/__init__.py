"""What people see of a diagnosis: a page, the same as JSON, and the car file with what was found.

write       all of it into one folder: `record` makes a `Report` of findings and evidence,
            and every file is written from that
record      the report as one record: sentences, cards and pictures, worked out once
sentences   verdict, where and when, advice; wording: names, numbers, units; panels: first screen
pictures    all SVGs, with residual_pictures, free_run_pictures and plot
fields      `report.json` and `drawn.json`; page and html_text: `report.html`
car_file    `car.toml` and its own effects, with toml_text; summary: the command's last lines
cars_page   the page of several cars
"""
