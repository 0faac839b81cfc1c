"""What level scanners see: `scene` stands around them, `grid` sorts it by place, `cast` looks."""
