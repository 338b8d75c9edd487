"""One cube in every kind of mesh file."""

import itertools
import struct

CORNERS = list(itertools.product((-1.0, 1.0), repeat=3))  # of a cube with edges of 2 m
FACES = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
         (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]  # fmt: skip


def binary_stl(size=1.0, corners=CORNERS):
    """A cube with edges of twice `size` [m], or what else has such corners."""
    facets = (
        struct.pack("<12fH", 0, 0, 0, *(size * x for i in face for x in corners[i]), 0) for face in FACES
    )
    return bytes(80) + struct.pack("<I", len(FACES)) + b"".join(facets)


def ascii_stl():
    def vertex(i):
        return "vertex " + " ".join(map(str, CORNERS[i]))

    facets = (
        "facet normal 0 0 0\nouter loop\n" + "\n".join(map(vertex, face)) + "\nendloop\nendfacet"
        for face in FACES
    )
    return ("solid cube\n" + "\n".join(facets) + "\nendsolid cube\n").encode()


def obj():
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES), ""]).encode()


def dae(unit="1", up="Z_UP", corners=CORNERS):
    positions = " ".join(str(c) for corner in corners for c in corner)
    indices = " ".join(str(i) for face in FACES for i in face)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{unit}" name="u"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>
<source id="p"><float_array id="pa" count="24">{positions}</float_array><technique_common>
<accessor source="#pa" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
""".encode()


def library():
    """A scene that shows a node of the library, which the engine doesn't look into."""
    shown = '<instance_geometry url="#g"/>'
    start, end = dae().decode().split(f'<node id="n">{shown}</node>')
    nodes = f'<library_nodes><node id="l">{shown}</node></library_nodes>'
    start = start.replace("<library_visual_scenes>", f"{nodes}<library_visual_scenes>")
    return f'{start}<node id="n"><instance_node url="#l"/></node>{end}'.encode()


def polylist():
    """The cube by its six squares, as Blender exports it."""
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    indices = " ".join(str(i) for square in squares for i in square)
    text = dae().decode()
    start, end = text.index('<triangles count="12">'), text.index("</triangles>")
    faces = (
        '<polylist count="6"><input semantic="VERTEX" source="#v" offset="0"/>'
        f"<vcount>4 4 4 4 4 4</vcount><p>{indices}</p></polylist>"
    )
    return (text[:start] + faces + text[end + len("</triangles>") :]).encode()
