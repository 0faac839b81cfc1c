"""Laws that the library does not hold, learned from recordings.

`learned` is the one general effect that the simulator carries to try them; `cells` asks what each
moment's force, angle or throttle would explain, `dictionary` lays shapes over what drives them,
`seek` refits the best by free run. `writing` turns a law into an effect's file, `curves` draws it.
"""
