"""The Blender worker, spoken to over its standard pipes; `launch.py` starts it in Blender's own
environment.

One scene is kept for as long as the process lives; a "scene" message sets its camera, light and
textures, a "frame" message swaps the meshes in place and is answered by the picture. It needs
nothing but Blender, NumPy and the standard library.

Messages, and their answers:

    scene  → done    engine, width, height, samples, bounces, threads, camera {matrix (4 × 4,
                     camera to world, looking along its −z, y up), focal, centre [px]}, sun {toward,
                     irradiance [W/m²], angle (its angular radius) [rad]}, sky (radiance of the
                     surroundings), objects [{name, albedo (linear), translucency}]; arrays
                     "texture/NAME" (height, width, 3) uint8 sRGB albedo, row 0 on top (v = 1)
    frame  → picture seed; arrays "positions/NAME" (vertex, 3) [m], "faces/NAME" (face, 3),
                     "uv/NAME" (vertex, 2), v up; answered by "rgba" (height, width, 4) float32:
                     linear radiance times coverage, coverage
    exit   → nothing
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import AnyArray, Float32Array, UInt8Array
from sim.blender.protocol import Message, decode, encode

_SENSOR = 36.0  # mm, of the camera model; only its ratio to the lens matters
_CLIP = (0.01, 1000.0)  # m, nearest and farthest that is rendered


class Studio:
    """Blender's scene: made once, changed by messages.

    Args:
        bpy: Blender's module.
        folder: where pictures pass through.
    """

    def __init__(self, bpy: Any, folder: Path) -> None:
        self._bpy = bpy
        self._picture = folder / "frame.exr"
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = self._scene = bpy.context.scene
        data = bpy.data
        self._camera = data.objects.new("camera", data.cameras.new("camera"))
        self._sun = data.objects.new("sun", data.lights.new("sun", "SUN"))
        for thing in (self._camera, self._sun):
            scene.collection.objects.link(thing)
        scene.camera = self._camera
        scene.world = data.worlds.new("world")
        scene.world.use_nodes = True
        scene.display_settings.display_device = "sRGB"
        scene.view_settings.view_transform = "Raw"
        scene.render.film_transparent = True
        scene.render.use_persistent_data = True
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_mode = "RGBA"
        scene.render.image_settings.color_depth = "32"
        scene.render.image_settings.exr_codec = "NONE"
        scene.render.filepath = str(self._picture)
        scene.render.dither_intensity = 0.0
        self._objects: dict[str, Any] = {}
        self._faces: dict[str, NDArray[np.int32]] = {}

    def set_scene(self, message: Message) -> None:
        """Sets camera, light, engine and materials."""
        fields, scene = message.fields, self._scene
        render = scene.render
        render.engine = fields["engine"]
        render.resolution_x, render.resolution_y = fields["width"], fields["height"]
        render.resolution_percentage = 100
        render.threads_mode, render.threads = "FIXED", fields["threads"]
        if fields["engine"] == "CYCLES":
            cycles = scene.cycles
            cycles.device = "CPU"
            cycles.samples = fields["samples"]
            cycles.max_bounces = cycles.diffuse_bounces = fields["bounces"]
            cycles.use_adaptive_sampling = cycles.use_denoising = False
            cycles.pixel_filter_type = "BOX"
        else:
            shading = scene.display.shading
            shading.light, shading.color_type, shading.show_shadows = "STUDIO", "TEXTURE", True
        self._set_camera(fields["camera"], fields["width"], fields["height"])
        self._set_light(fields)
        self._set_objects(fields["objects"], message.arrays)

    def _set_camera(self, camera: Mapping[str, Any], width: int, height: int) -> None:
        lens = self._camera.data
        larger = max(width, height)
        lens.sensor_fit, lens.sensor_width = (
            ("HORIZONTAL" if width >= height else "VERTICAL"),
            _SENSOR,
        )
        lens.sensor_height = _SENSOR
        lens.lens = camera["focal"] * _SENSOR / larger
        # The shifts are in units of the larger side; the picture's y goes down, the camera's up.
        lens.shift_x = (width / 2 - camera["centre"][0]) / larger
        lens.shift_y = (camera["centre"][1] - height / 2) / larger
        lens.clip_start, lens.clip_end = _CLIP
        self._camera.matrix_world = import_module("mathutils").Matrix(camera["matrix"])

    def _set_light(self, fields: Mapping[str, Any]) -> None:
        vector = import_module("mathutils").Vector(fields["sun"]["toward"])
        self._sun.rotation_mode = "QUATERNION"
        self._sun.rotation_quaternion = vector.to_track_quat("Z", "Y")  # a lamp shines along its −z
        self._sun.data.energy = fields["sun"]["irradiance"]
        self._sun.data.angle = 2 * fields["sun"]["angle"]
        sky = self._scene.world.node_tree.nodes["Background"]
        sky.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        sky.inputs["Strength"].default_value = fields["sky"]

    def _set_objects(
        self, objects: list[Mapping[str, Any]], arrays: Mapping[str, AnyArray]
    ) -> None:
        data = self._bpy.data
        for thing in self._objects.values():
            mesh = thing.data
            data.objects.remove(thing)
            data.meshes.remove(mesh)
        for store in (data.materials, data.images):
            for entry in list(store):
                if entry.name != "Render Result":
                    store.remove(entry)
        self._objects, self._faces = {}, {}
        for described in objects:
            name = described["name"]
            mesh = data.meshes.new(name)
            mesh.materials.append(self._material(described, arrays.get(f"texture/{name}")))
            self._objects[name] = data.objects.new(name, mesh)
            self._scene.collection.objects.link(self._objects[name])

    def _material(self, described: Mapping[str, Any], texture: UInt8Array | None) -> Any:
        """Makes a diffuse sheet that reflects the share 1 − t of its albedo and transmits t."""
        material = self._bpy.data.materials.new(described["name"])
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        kinds = ("BsdfDiffuse", "BsdfTranslucent", "MixShader", "OutputMaterial")
        diffuse, translucent, mix, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in kinds)
        mix.inputs["Fac"].default_value = described["translucency"]
        tree.links.new(diffuse.outputs["BSDF"], mix.inputs[1])
        tree.links.new(translucent.outputs["BSDF"], mix.inputs[2])
        tree.links.new(mix.outputs["Shader"], output.inputs["Surface"])
        for side in (diffuse, translucent):
            side.inputs["Color"].default_value = (*described["albedo"], 1.0)
        if texture is not None:
            sampled = tree.nodes.new("ShaderNodeTexImage")
            sampled.image, sampled.extension = self._image(described["name"], texture), "EXTEND"
            for side in (diffuse, translucent):
                tree.links.new(sampled.outputs["Color"], side.inputs["Color"])
            tree.nodes.active = sampled
        return material

    def _image(self, name: str, texture: UInt8Array) -> Any:
        height, width, _ = texture.shape
        image = self._bpy.data.images.new(name, width=width, height=height, alpha=False)
        pixels = np.ones((height, width, 4), dtype=np.float32)
        pixels[..., :3] = texture[::-1].astype(np.float32) / 255
        image.pixels.foreach_set(pixels.ravel())
        image.update()
        return image

    def picture(self, message: Message) -> Float32Array:
        """Renders the meshes of a "frame" message, (height, width, 4)."""
        for name, thing in self._objects.items():
            arrays = message.arrays
            self._shape(
                name,
                thing,
                arrays[f"positions/{name}"],
                arrays[f"faces/{name}"],
                arrays[f"uv/{name}"],
            )
        if self._scene.render.engine == "CYCLES":
            self._scene.cycles.seed = message.fields["seed"]
        self._bpy.ops.render.render(write_still=True)
        return self._read()

    def _shape(
        self,
        name: str,
        thing: Any,
        positions: Float32Array,
        faces: NDArray[np.int32],
        uv: Float32Array,
    ) -> None:
        mesh = thing.data
        same = (
            name in self._faces
            and np.array_equal(self._faces[name], faces)
            and len(mesh.vertices) == len(positions)
        )
        if not same:
            mesh.clear_geometry()
            mesh.from_pydata(np.zeros((len(positions), 3)).tolist(), [], faces.tolist())
            layer = mesh.uv_layers.new(name="uv")
            layer.data.foreach_set(
                "uv", np.ascontiguousarray(uv[faces.ravel()], dtype=np.float32).ravel()
            )
            mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), dtype=bool))
            self._faces[name] = faces
        mesh.vertices.foreach_set("co", np.ascontiguousarray(positions, dtype=np.float32).ravel())
        mesh.update()
        thing.update_tag()

    def _read(self) -> Float32Array:
        """Reads the picture that was written; Blender gives the pixels of a render only by way of a
        file."""
        image = self._bpy.data.images.load(str(self._picture))
        try:
            image.colorspace_settings.name = "Non-Color"
            width, height = image.size
            pixels = np.empty(width * height * 4, dtype=np.float32)
            image.pixels.foreach_get(pixels)
        finally:
            self._bpy.data.images.remove(image)
        return pixels.reshape(height, width, 4)[::-1]


def serve(bpy: Any, source: int, sink: int) -> None:
    """Answers messages from one file descriptor on another until the stream ends or says so."""

    def read(count: int) -> bytes:
        parts: list[bytes] = []
        while count:
            part = os.read(source, min(count, 1 << 20))
            if not part:
                raise EOFError
            parts.append(part)
            count -= len(part)
        return b"".join(parts)

    def send(message: Message) -> None:
        data = memoryview(encode(message))
        while data:
            data = data[os.write(sink, data) :]

    with tempfile.TemporaryDirectory(prefix="flagdata-render-") as folder:
        studio = Studio(bpy, Path(folder))
        send(Message(kind="ready", fields={"blender": bpy.app.version_string}))
        while True:
            try:
                message = decode(read)
                if message.kind == "exit":
                    return
                send(_answer(studio, message))
            except (EOFError, BrokenPipeError):  # the caller is gone
                return


def _answer(studio: Studio, message: Message) -> Message:
    try:
        if message.kind == "scene":
            studio.set_scene(message)
            return Message(kind="done")
        return Message(kind="picture", arrays={"rgba": studio.picture(message)})
    except (RuntimeError, ValueError, TypeError, KeyError, AttributeError, OSError) as error:
        return Message(kind="error", fields={"what": f"{type(error).__name__}: {error}"})


def main() -> None:
    sink = os.dup(1)
    os.dup2(2, 1)  # what Blender prints goes with the errors, not among the answers
    serve(import_module("bpy"), 0, sink)
    sys.stderr.flush()
    os._exit(0)  # Blender's own clean-up may hang
