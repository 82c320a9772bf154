"""Layouts for viewers of recordings: `calibeam layouts`.

`views` lists which topics and fields stand together, whatever the viewer. A new viewer is a file that turns these views
into the form of its own files, as `foxglove` and `plotjuggler` do.
"""
