"""What blender.sh does in Blender: ... -P blender.py -- bake ADDON.zip MESH.obj OUT.nif, or show ADDON.zip MESH.obj IN.nif OUT.png

`bake` prints how long the add-on's operator takes; `show` what it says and how long, and renders what it shows.
"""
import math
import sys
import time
from pathlib import Path

import bpy
from mathutils import Vector

verb, package, mesh, asset, *picture = sys.argv[sys.argv.index("--") + 1 :]
SCALE = 0.01


def seconds(operator, **arguments) -> float:
    start = time.perf_counter()
    assert operator(**arguments) == {"FINISHED"}
    return time.perf_counter() - start


def shown(name: str) -> bpy.types.Material:
    """A material that shines in the colours of this name."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    color, emission, output = (nodes.new(kind) for kind in ("ShaderNodeAttribute", "ShaderNodeEmission", "ShaderNodeOutputMaterial"))
    color.attribute_name = name
    links.new(color.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


def render(model: bpy.types.Object, names: list, path: str) -> None:
    """The model once for each name, side by side; y points up."""
    size, wide = max(model.dimensions), 1.05 * model.dimensions.x
    middle = sum((Vector(corner) for corner in model.bound_box), Vector()) / 8
    for number, name in enumerate(names):
        copy = model if number == 0 else model.copy()
        if number:
            copy.data = model.data.copy()
            bpy.context.collection.objects.link(copy)
        copy.data.materials.clear()
        copy.data.materials.append(shown(name))
        copy.location.x = number * wide
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", len(names) * wide
    camera.data.clip_end = 10 * size
    camera.location = middle + Vector((wide * (len(names) - 1) / 2, 0, 3 * size))
    scene = bpy.context.scene
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("dark")
    scene.world.color = 0.02, 0.02, 0.03
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 16
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.resolution_percentage = 100
    scene.render.resolution_x = 1200
    scene.render.resolution_y = math.ceil(1200 / (len(names) * wide) * 1.05 * model.dimensions.y)
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


bpy.ops.preferences.addon_install(filepath=package)
bpy.ops.preferences.addon_enable(module="nifkit_blender")
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.wm.obj_import(filepath=mesh, forward_axis="Y", up_axis="Z")
model = bpy.context.scene.objects[0]
model.select_set(True)
bpy.context.view_layer.objects.active = model
if verb == "bake":
    from nifkit_blender import geometry, glb

    whole = seconds(bpy.ops.nifkit.bake, filepath=asset, preset="fast", options="--rays 0")
    start = time.perf_counter()
    glb.write(geometry.collect(bpy.context.evaluated_depsgraph_get(), [model]), Path(asset + ".glb"))
    print(f"seconds {whole:.1f} {time.perf_counter() - start:.1f}")
    Path(asset + ".glb").unlink()
else:
    bpy.context.scene.nifkit.asset = asset
    print(f"vertices {len(model.data.vertices):,}")
    print(f"scale {100 * SCALE:.0f} %")
    print(f"errors {seconds(bpy.ops.nifkit.show_errors, scale=SCALE, rays=16):.0f}")
    print(f"asset {seconds(bpy.ops.nifkit.show_asset, beside=False, rays=16):.0f}")
    render(model, ["nifkit asset", "nifkit Blender", "nifkit errors"], bpy.path.abspath(picture[0]))
