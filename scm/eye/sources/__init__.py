"""Where frames come from, one module each: `synthetic` renders the world, `file` plays a film."""
