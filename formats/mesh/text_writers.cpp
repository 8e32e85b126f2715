// Vertices and triangles are fetched in chunks, so memory does not grow with the scene; STL holds one
// instance at a time. Numbers have the fewest digits that read back as the same value.
#include "formats/mesh/text_writers.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace nif::mesh::detail {
namespace {

constexpr uint64_t kChunk = 1 << 14;

void get(const FlatScene& flat, uint64_t first, std::span<Float3> out) { flat.vertices(first, out); }
void get(const FlatScene& flat, uint64_t first, std::span<Double3> out) { flat.exact(first, out); }

template <class Point, class Put>
void each_vertex(const FlatScene& flat, uint64_t first, uint64_t last, Put put) {
  std::vector<Point> chunk;
  for (; first < last; first += chunk.size()) {
    chunk.resize(std::min(kChunk, last - first));
    get(flat, first, chunk);
    for (const Point& p : chunk) put(p);
  }
}

/// Calls `put` for the vertices of an instance, in order: with doubles if floats are too coarse.
template <class Put>
void each_vertex(const FlatScene& flat, size_t instance, Put put) {
  const uint64_t first = flat.first_vertex(instance), last = flat.first_vertex(instance + 1);
  flat.far(instance) ? each_vertex<Double3>(flat, first, last, put)
                     : each_vertex<Float3>(flat, first, last, put);
}

template <class Put>
void each_triangle(const FlatScene& flat, uint64_t first, uint64_t last, Put put) {
  std::vector<Triangle> chunk;
  for (; first < last; first += chunk.size()) {
    chunk.resize(std::min(kChunk, last - first));
    flat.triangles(first, chunk);
    for (const Triangle& t : chunk) put(t);
  }
}

template <class Point>
void put_point(Stream& out, const Point& p) {
  out.put(p[0]);
  for (size_t axis = 1; axis < 3; ++axis) {
    out.put(' ');
    out.put(p[axis]);
  }
  out.put('\n');
}

/// Makes a name fit on one line of text.
std::string line_of(std::string name) {
  if (ends_in_backslash(name)) name[name.rfind('\\')] = '_';
  return name;
}

template <class Point>
struct Facet {
  Float3 normal;
  std::array<Point, 3> corners;
};

/// Calls `put` for the facets of an instance.
template <class Point, class Put>
void each_facet(const FlatScene& flat, size_t instance, Put put) {
  const uint64_t first_vertex = flat.first_vertex(instance);
  std::vector<Point> points(flat.first_vertex(instance + 1) - first_vertex);
  get(flat, first_vertex, points);
  const uint64_t first = flat.first_triangle(instance), last = flat.first_triangle(instance + 1);
  each_triangle(flat, first, last, [&](const Triangle& t) {
    Facet<Point> facet{
        {}, {points[t[0] - first_vertex], points[t[1] - first_vertex], points[t[2] - first_vertex]}};
    std::array<double, 3> a, b, n;
    for (size_t axis = 0; axis < 3; ++axis) {
      a[axis] = double(facet.corners[1][axis]) - facet.corners[0][axis];
      b[axis] = double(facet.corners[2][axis]) - facet.corners[0][axis];
    }
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t next = (axis + 1) % 3, last_axis = (axis + 2) % 3;
      n[axis] = a[next] * b[last_axis] - a[last_axis] * b[next];
    }
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (length > 0 && std::isfinite(length))
      for (size_t axis = 0; axis < 3; ++axis) facet.normal[axis] = float(n[axis] / length);
    put(facet);
  });
}

}  // namespace

bool ends_in_backslash(std::string_view name) {
  const size_t last = name.find_last_not_of(" \t\v\f\r");
  return last != name.npos && name[last] == '\\';
}

void write_obj(Stream& out, const Scene& scene, const FlatScene& flat) {
  out.put("# nifkit\n");
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    out.put("o ");
    out.put(line_of(scene.instances[i].name));
    out.put('\n');
    each_vertex(flat, i, [&](const auto& p) {
      out.put("v ");
      put_point(out, p);
      out.step();
    });
    each_triangle(flat, flat.first_triangle(i), flat.first_triangle(i + 1), [&](const Triangle& t) {
      out.put('f');
      for (const uint32_t v : t) {
        out.put(' ');
        out.put(uint64_t{v} + 1);
      }
      out.put('\n');
      out.step();
    });
  }
}

void write_off(Stream& out, const FlatScene& flat) {
  out.put("OFF\n");
  out.put(flat.vertex_count());
  out.put(' ');
  out.put(flat.triangle_count());
  out.put(" 0\n");
  for (size_t i = 0; i < flat.instance_count(); ++i)
    each_vertex(flat, i, [&](const auto& p) {
      put_point(out, p);
      out.step();
    });
  each_triangle(flat, 0, flat.triangle_count(), [&](const Triangle& t) {
    out.put('3');
    for (const uint32_t v : t) {
      out.put(' ');
      out.put(v);
    }
    out.put('\n');
    out.step();
  });
}

void write_stl(Stream& out, const FlatScene& flat) {
  std::array<char, 80> header{};
  std::memcpy(header.data(), "nifkit", 6);
  out.put_bytes(header);
  out.put_bytes(uint32_t(flat.triangle_count()));
  for (size_t i = 0; i < flat.instance_count(); ++i)
    each_facet<Float3>(flat, i, [&](const Facet<Float3>& facet) {
      out.put_bytes(facet);
      out.put_bytes(uint16_t{0});
      out.step();
    });
}

void write_stl_text(Stream& out, const Scene& scene, const FlatScene& flat) {
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    out.put("solid ");
    out.put(scene.instances[i].name);
    out.put('\n');
    const auto put = [&](const auto& facet) {
      out.put("facet normal ");
      put_point(out, facet.normal);
      out.put("outer loop\n");
      for (const auto& corner : facet.corners) {
        out.put("vertex ");
        put_point(out, corner);
      }
      out.put("endloop\nendfacet\n");
      out.step();
    };
    flat.far(i) ? each_facet<Double3>(flat, i, put) : each_facet<Float3>(flat, i, put);
    out.put("endsolid\n");
  }
}

}  // namespace nif::mesh::detail
