// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes that are hard for a proxy, about 0.1 m long and around the origin unless they say otherwise.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "polygon/mesh.h"

namespace tests {

using polygon::TriangleMesh;

// Closed, and seen wholly from the origin: a sphere of which each vertex goes in or out by up to `noise` of
// its radius.
TriangleMesh noisy_sphere(int subdivisions, double noise, std::uint64_t seed);
// The same with a spike at every eighth vertex: needle triangles on both sides of deep pits.
TriangleMesh spiky_star(int subdivisions, double spike, std::uint64_t seed);
// Closed: n x n quads of random heights on a block with a flat bottom.
TriangleMesh terrain_block(int n, double roughness, std::uint64_t seed);
// Closed: grid lines whose distances grow by `growth` from the middle, so that one mesh holds edges of very
// different length, and needles.
TriangleMesh unequal_block(int n, double growth, std::uint64_t seed);
TriangleMesh torus(int around, int across, double noise, std::uint64_t seed);
// The surface of random cubes of an n³ lattice: concave corners, and edges where four faces meet.
TriangleMesh cubes(int n, double share, std::uint64_t seed);
// Closed: `sides` triangles at the tip, and as many at the middle of the base.
TriangleMesh cone(int sides);
TriangleMesh uv_sphere(int around, int rings);
// A box of 1e-4 of its length.
TriangleMesh thin_plate();
// Open, without thickness: n x n quads of random heights.
TriangleMesh sheet(int n, double roughness, std::uint64_t seed);
// Open: sheets that cross one another, and one that touches another along a line.
TriangleMesh crossed_sheets();
// Every triangle `copies` times, every other one turned over.
TriangleMesh repeated(const TriangleMesh& mesh, int copies);

struct HostileMesh {
  std::string name;
  TriangleMesh mesh;
  bool solid = true;  // closed, so that inside and outside mean something
};
// One of each, small enough to be checked exactly.
std::vector<HostileMesh> hostile_meshes(std::uint64_t seed);

}  // namespace tests
