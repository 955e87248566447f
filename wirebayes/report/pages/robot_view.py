"""A robot that can be turned, from the points that a command left in ``scene.json``."""

from pathlib import Path

from wirebayes.io.run_folder import read_json
from wirebayes.json_files.scene import SceneJson
from wirebayes.report.blocks import Block, View, number

FILE = "scene.json"


def robot_view(folder: Path) -> list[Block]:
    """The view, or nothing where the folder has no such file."""
    if not (folder / FILE).is_file():
        return []
    scene: SceneJson = read_json(folder / FILE)
    alt = f"Robot {scene['name']}: exit points, wires and platform"
    known = [tension for row in scene["tensions_N"] for tension in row if tension is not None]
    about = []
    if known:
        low = number(min(known))
        high = number(max(known))
        reach = f"from {low} N (blue) to {high} N (red)"
        about.append(f"Wires coloured by their median tension, {reach}; a broken line is a slack wire.")
    if scene["drifted"]:
        alt += " where it was sent and where creep takes it"
        enlarged = f"enlarged {scene['exaggeration']:g} times"
        about.append(f"Blue platform: the commanded pose. Red platform with dotted wires: the mean drift, {enlarged}.")
    about.append("Squares: exit points with the number of their wire. Drag, or press a button, to turn it.")
    caption = " ".join(about)
    return [View(scene, f"{alt}.", caption)]
