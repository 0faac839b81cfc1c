"""What people see of a diagnosis: a page, the same as JSON, and the car file with what was found.

write       all of it into one folder; as_json  the fixed fields; summary  the command line's lines
car_file, toml_text, own_files   the given car's file with the effects found, comments kept
page, first_screen, expert, tables, style.css    one self-contained HTML page
plot, floor_map, time_line, free_runs, intervals, bars     its pictures, as SVG
"""
