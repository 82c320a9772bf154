"""A layout for PlotJuggler 3: one tab each for spots, joints and devices; series are topic/field of its MCAP plugin.

Form: what the program's "Save layout" writes (plotjuggler_app, tabbed widgets; DataLoad MCAP, xmlSaveState).
"""

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from calibeam.layouts.foxglove import COLOURS
from calibeam.layouts.views import Panel, Views, panels

ROWS = 3  # panels of a tab, one above the other
LARGEST_ARRAY = "500"  # the plugin's own limit: views hold no arrays


def plotjuggler_layout(views: Views) -> str:
    """The layout as its XML document."""
    found = panels(views)
    root = Element("root")
    tabs = SubElement(root, "tabbed_widget", {"parent": "main_window", "name": "Main Window"})
    for start in range(0, len(found), ROWS):
        _tab(tabs, found[start : start + ROWS])
    SubElement(tabs, "currentTabIndex", index="0")
    SubElement(root, "use_relative_time_offset", enabled="1")
    plugin = SubElement(SubElement(root, "Plugins"), "plugin", ID="DataLoad MCAP")
    SubElement(
        plugin,
        "parameters",
        use_timestamp="0",
        use_mcap_log_time="1",
        clamp_large_arrays="1",
        max_array_size=LARGEST_ARRAY,
        selected_topics=";".join(views.views),
    )
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def _tab(tabs: Element, shown: Sequence[Panel]) -> None:
    tab = SubElement(tabs, "Tab", tab_name=shown[0].name, containers="1")
    share = ";".join([f"{1.0 / len(shown):.6f}"] * len(shown))
    split = SubElement(
        SubElement(tab, "Container"), "DockSplitter", orientation="-", count=str(len(shown)), sizes=share
    )
    for panel in shown:
        plot = SubElement(
            SubElement(split, "DockArea", name=panel.name),
            "plot",
            mode="TimeSeries",
            style="Lines",
            flip_x="false",
            flip_y="false",
        )
        SubElement(plot, "limitY")
        for number, (topic, field) in enumerate(panel.curves):
            SubElement(plot, "curve", name=f"{topic}/{field}", color=COLOURS[number % len(COLOURS)])
