"""Reading files that are not trusted: YAML with limits, typed by pydantic with physical bounds."""
