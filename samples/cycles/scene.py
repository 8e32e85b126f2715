"""Renders a mesh on a floor under a sun and a sky, in Cycles. Blender runs it (run.sh does):

    blender -b --factory-startup -P scene.py -- MESH.obj PICTURE.png SIZE SAMPLES asset|none|triangles

SIZE is the picture's width and height in pixels, SAMPLES the paths per pixel. The last word says what casts the mesh's shadow:
its triangles; nothing; or an asset, through the preloaded library, in which case the mesh itself casts none, either.
Prints "seconds N": processor time of all threads, from the scene to the picture. The mesh's y axis points up.
"""
import math
import sys
import time

import bpy
from mathutils import Matrix, Vector

SOLID = 0.8, 0.8, 0.8, 1


def matte(name: str, color: tuple) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = color
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    return material


def look(thing: bpy.types.Object, at: Vector) -> None:
    """Rotates a camera or a light. Up in the picture is the mesh's y, not Blender's z."""
    back = (thing.location - at).normalized()
    right = Vector((0, 1, 0)).cross(back).normalized()
    thing.rotation_mode = "QUATERNION"
    thing.rotation_quaternion = Matrix((right, back.cross(right), back)).transposed().to_quaternion()


def build(mesh: str, shadow: str) -> None:
    """One object from the file, with unchanged coordinates, because the asset uses these."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=mesh, forward_axis="Y", up_axis="Z")
    model = bpy.context.scene.objects[0]
    model.data.materials.clear()
    model.data.materials.append(matte("model", SOLID))
    model.data.polygons.foreach_set("use_smooth", [False] * len(model.data.polygons))
    model.visible_shadow = shadow == "triangles"

    corners = [Vector(corner) for corner in model.bound_box]
    low = Vector(min(c[a] for c in corners) for a in range(3))
    high = Vector(max(c[a] for c in corners) for a in range(3))
    middle, size = (low + high) / 2, max(high - low)

    far = 300 * size
    floor = bpy.data.meshes.new("floor")
    floor.from_pydata([(x, low.y, z) for x, z in ((-far, -far), (-far, far), (far, far), (far, -far))], [], [(0, 1, 2, 3)])
    floor.materials.append(matte("floor", (0.5, 0.5, 0.5, 1)))
    bpy.context.collection.objects.link(bpy.data.objects.new("floor", floor))

    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 3, math.radians(3)
    sun.location = middle + Vector((-1.2, 1.6, 1.0)) * size
    look(sun, middle)
    bpy.context.collection.objects.link(sun)

    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = 0.5, 0.6, 0.8, 1
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.6
    bpy.context.scene.world = world

    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.clip_start, camera.data.clip_end = 0.01 * size, 100 * size
    camera.location = middle + Vector((0.5, 0.55, 1.9)) * size
    look(camera, middle)
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def render(picture: str, size: int, samples: int) -> float:
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples, scene.cycles.seed = samples, 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 0
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGB"
    scene.render.filepath = picture
    start = time.process_time()
    bpy.ops.render.render(write_still=True)
    return time.process_time() - start


def main() -> None:
    mesh, picture, size, samples, shadow = sys.argv[sys.argv.index("--") + 1 :]
    build(mesh, shadow)
    print(f"seconds {render(picture, int(size), int(samples)):.3f}")


try:
    main()
except Exception as error:  # else Blender would end with 0
    print(f"scene.py: {error}", file=sys.stderr)
    sys.exit(1)
