"""Effects outside the catalogue, discovered from a dictionary of shapes.

`general_effect` is the one effect that a simulator carries to try them; `impulse_response` computes
what each moment's force, angle or throttle would explain, `dictionary` lists shapes over what may
drive them, `try_dictionary` refits the best by free run and `decide` compares them with the
catalogue. `dictionary_effect` writes one as an effect's file.
"""
