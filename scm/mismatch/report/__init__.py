"""What people see of a diagnosis: a page, the same as JSON, and the car file with what was found.

write       all of it into one folder; as_json  the fixed fields; summary  the command line's lines
car_file    the given car's file with the effects found, by estimates, toml_text and own_files
page        one self-contained HTML page of first_screen and expert, in wording and advice
drawings    its pictures, drawn by plot: floor_map, time_line, free_run_pictures, forest, bars ...
"""
