"""contextdb in Blender: clips into a project, what may play at this frame and why not, recorded sessions, builds.

An add-on of one file for Blender 4.2 and later: Edit ▸ Preferences ▸ Add-ons ▸ Install from Disk. It calls the command `contextdb`,
which is installed beside Blender, in any Python of its own; the preferences of the add-on say where it is. Its panel is in the
sidebar of the 3D view.

    Import clips     files of clips are copied into the folder of the project's clips, and get rows in the table
    Send action      the action of the armature becomes a .glb there, and the databases are built
    Ask              which assets are valid for the facts of this frame, and why the others are not
    Play session     a recorded session as an armature that moves, with a marker where another clip begins

The facts are the custom properties of the active object, named like the conditions of the table; they may be animated.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

try:
    import bpy
except ImportError:  # the functions above the line are of use without
    bpy = None

bl_info = {
    "name": "contextdb",
    "description": "Which animations may play now, and why the others may not",
    "author": "contextdb contributors",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > contextdb",
    "category": "Animation",
}
CLIPS = "clips"
BUILD_S = 3600.0
MOST_LINES = 12
"""So many assets of each kind are shown."""


class CommandError(Exception):
    """What the command says is wrong."""


def called(command: str, words: Sequence[str], accepted: Sequence[int] = (0, 1)) -> str:
    """What `contextdb` prints for some words. Raises CommandError with what it says where it is not there, or refuses."""
    try:
        done = subprocess.run([*command.split("\n"), *words], capture_output=True, encoding="utf-8", timeout=BUILD_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CommandError(f"{command} cannot be run: {error}. The add-on's preferences say where contextdb is.") from None
    if done.returncode not in accepted:
        raise CommandError(done.stderr.strip() or f"contextdb ended with {done.returncode}.")
    return done.stdout


def facts_of(properties: Mapping[str, object]) -> dict[str, str]:
    """The facts among custom properties: numbers, texts and truths."""
    plain = {name: value for name, value in properties.items() if isinstance(value, (bool, int, float, str)) and name[:1] != "_"}
    return {name: value if isinstance(value, str) else repr(value) for name, value in plain.items()}


def answer(command: str, table: str, facts: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """The assets that may play for some facts, and for each of the others why it may not."""
    words = [f"{name}={value}" for name, value in facts.items()]
    document = json.loads(called(command, ["query", table, *words, "--unknown", "any", "--explain", "--json"]))
    return [each["asset"] for each in document["matches"]], [_reason(each) for each in document["explain"] if _reason(each)]


def _reason(row: Mapping[str, Any]) -> str:
    """Why a row is not valid, in a line; nothing of one that is."""
    if not row.get("enabled", True):
        return f"{row['asset']}: disabled"
    failures = [f"{each['condition']} is {each['fact']}, not {each['cell']}" for each in row.get("failures", [])]
    return f"{row['asset']}: {'; '.join(failures)}" if failures else ""


def changes(session: Mapping[str, Any]) -> list[tuple[float, str]]:
    """When another clip begins in a session, and which; of the document that `motion replay --json` prints."""
    begins = (each for each in session["decisions"] if each["action"] in ("starts", "jumps") and each["playing"])
    return [(float(each["time_s"]), str(each["playing"]["asset"])) for each in begins]


def clip_file(folder: str, name: str) -> Path:
    """The file of a clip of a name in the folder of a project's clips."""
    plain = re.sub(r'[<>:"/\\|?*\x00-\x1f]', "_", name).strip(" .") or "clip"
    path = Path(folder) / CLIPS
    path.mkdir(parents=True, exist_ok=True)
    return path / f"{plain}.glb"


def import_files(command: str, folder: str, table: str, files: Sequence[str]) -> str:
    """Copy files of clips into a project, and give the table rows of them; what the command says of that. A file that is no clip is
    not copied."""
    called(command, ["motion", "bones", *files], accepted=(0,))
    for file in files:
        clip_file(folder, "clip")
        shutil.copy(file, Path(folder) / CLIPS / Path(file).name)
    is_new = not Path(table).exists()
    return called(command, ["motion", "describe", folder, "--out" if is_new else "--into", table])


def build(command: str, folder: str) -> str:
    """Build the databases of a project; the table that the command prints."""
    return called(command, ["motion", "build", folder, "--keep-going"])


# ---- Blender


if bpy is not None:

    def _command(context: Any) -> str:
        addon = context.preferences.addons.get(__name__)
        return addon.preferences.command if addon is not None else os.environ.get("CONTEXTDB", "contextdb")

    class ContextdbPreferences(bpy.types.AddonPreferences):
        bl_idname = __name__
        __annotations__ = {
            "command": bpy.props.StringProperty(name="contextdb", default="contextdb", description="The command, or its path")
        }

        def draw(self, context: Any) -> None:
            self.layout.prop(self, "command")

    class ContextdbSettings(bpy.types.PropertyGroup):
        __annotations__ = {
            "folder": bpy.props.StringProperty(name="Project", subtype="DIR_PATH", description="The folder of contextdb.toml"),
            "table": bpy.props.StringProperty(name="Table", subtype="FILE_PATH", description="The table that is asked"),
            **{name: bpy.props.StringProperty(options={"HIDDEN"}) for name in ("valid", "others", "said")},
        }

    class _Operator(bpy.types.Operator):
        """Runs a command, and reports what it says where it refuses."""

        def execute(self, context: Any) -> set[str]:
            settings = context.scene.contextdb
            try:
                settings.said = self.work(context, settings).strip()
            except CommandError as error:
                settings.said = str(error)
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            return {"FINISHED"}

        def work(self, context: Any, settings: Any) -> str:
            raise NotImplementedError

    class CONTEXTDB_OT_ask(_Operator):
        bl_idname, bl_label = "contextdb.ask", "Ask"
        bl_description = "Which assets are valid for the facts of this frame"

        def work(self, context: Any, settings: Any) -> str:
            facts = facts_of(dict(context.object.items())) if context.object is not None else {}
            valid, others = answer(_command(context), bpy.path.abspath(settings.table), facts)
            settings.valid, settings.others = json.dumps(valid), json.dumps(others)
            return f"{len(valid)} of {len(valid) + len(others)} valid"

    class CONTEXTDB_OT_import_clips(_Operator):
        bl_idname, bl_label = "contextdb.import_clips", "Import clips"
        bl_description = "Copy files of clips into the project, and give the table rows of them"
        __annotations__ = {
            "directory": bpy.props.StringProperty(subtype="DIR_PATH"),
            "files": bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement),
        }

        def invoke(self, context: Any, event: Any) -> set[str]:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}

        def work(self, context: Any, settings: Any) -> str:
            paths = [os.path.join(self.directory, each.name) for each in self.files]
            return import_files(_command(context), bpy.path.abspath(settings.folder), bpy.path.abspath(settings.table), paths)

    class CONTEXTDB_OT_send_action(_Operator):
        bl_idname, bl_label = "contextdb.send_action", "Send action"
        bl_description = "Write the action of the armature into the project's clips, and build its databases"

        def work(self, context: Any, settings: Any) -> str:
            armature, folder = context.object, bpy.path.abspath(settings.folder)
            if armature is None or armature.type != "ARMATURE" or not armature.animation_data or not armature.animation_data.action:
                raise CommandError("The active object is no armature with an action.")
            for each in context.selected_objects:
                each.select_set(False)
            armature.select_set(True)
            path = clip_file(folder, armature.animation_data.action.name)
            bpy.ops.export_scene.gltf(
                filepath=str(path), export_format="GLB", use_selection=True, export_animation_mode="ACTIVE_ACTIONS"
            )
            return build(_command(context), folder)

    class CONTEXTDB_OT_play_session(_Operator):
        bl_idname, bl_label = "contextdb.play_session", "Play session"
        bl_description = "A session of `contextdb motion run --poses FILE.bvh`, with a marker where another clip begins"
        __annotations__ = {
            "filepath": bpy.props.StringProperty(subtype="FILE_PATH"),
            "filter_glob": bpy.props.StringProperty(default="*.parquet", options={"HIDDEN"}),
        }

        def invoke(self, context: Any, event: Any) -> set[str]:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}

        def work(self, context: Any, settings: Any) -> str:
            poses = Path(self.filepath).with_suffix(".bvh")
            if not poses.is_file():
                raise CommandError(
                    f"There are no poses of this session: {poses.name}, as `motion run --poses {poses.name}` writes them."
                )
            begins = changes(json.loads(called(_command(context), ["motion", "replay", self.filepath, "--json"])))
            bpy.ops.import_anim.bvh(filepath=str(poses), global_scale=0.01, rotate_mode="QUATERNION", update_scene_fps=True)
            context.scene.timeline_markers.clear()
            rate = context.scene.render.fps / context.scene.render.fps_base
            for time_s, asset in begins:
                context.scene.timeline_markers.new(asset, frame=1 + round(time_s * rate))
            action = context.object.animation_data.action
            context.scene.frame_start, context.scene.frame_end = 1, round(action.frame_range[1])
            return f"{poses.stem}: {len(begins)} clips"

    class CONTEXTDB_PT_panel(bpy.types.Panel):
        bl_idname, bl_label = "CONTEXTDB_PT_panel", "Valid now / why not"
        bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "contextdb"

        def draw(self, context: Any) -> None:
            settings, layout = context.scene.contextdb, self.layout
            layout.prop(settings, "folder")
            layout.prop(settings, "table")
            for operator in OPERATORS:
                layout.operator(operator.bl_idname)
            for line in settings.said.splitlines()[:MOST_LINES]:
                layout.label(text=line)
            for label, text in (("Valid now", settings.valid), ("Why not", settings.others)):
                listed = json.loads(text or "[]")
                box = layout.box()
                box.label(text=f"{label}: {len(listed)}")
                for line in listed[:MOST_LINES]:
                    box.label(text=line)

    OPERATORS = (CONTEXTDB_OT_ask, CONTEXTDB_OT_import_clips, CONTEXTDB_OT_send_action, CONTEXTDB_OT_play_session)
    CLASSES = (ContextdbPreferences, ContextdbSettings, *OPERATORS, CONTEXTDB_PT_panel)

    def register() -> None:
        """Called by Blender when the add-on is enabled."""
        for each in CLASSES:
            bpy.utils.register_class(each)
        bpy.types.Scene.contextdb = bpy.props.PointerProperty(type=ContextdbSettings)

    def unregister() -> None:
        """Called by Blender when the add-on is disabled."""
        del bpy.types.Scene.contextdb
        for each in reversed(CLASSES):
            bpy.utils.unregister_class(each)
