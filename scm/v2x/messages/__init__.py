"""One message a file: `MESSAGE` is the class. The file name is the class name in snake case."""
