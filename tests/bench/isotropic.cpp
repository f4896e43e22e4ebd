// The peer of like quality: volumeToMesh, and CGAL's isotropic remeshing of it to edges of the length EDGE. What makes a polygon
// mesh of volumeToMesh's triangles, which need not be manifold, is a stage of its own: "repair".
#include "peer.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Surface_mesh.h>

#include <array>

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

static constexpr unsigned ITERATIONS = 3; // as in CGAL's own example

static SurfaceMesh repair(const PeerMesh &m)
{
    std::vector<Point> points;
    std::vector<std::array<size_t, 3>> polygons;
    for (const auto &p : m.point) points.emplace_back(p.x(), p.y(), p.z());
    for (const auto &t : m.triangle) polygons.push_back({t[0], t[1], t[2]});
    PMP::repair_polygon_soup(points, polygons);
    PMP::orient_polygon_soup(points, polygons);
    SurfaceMesh s;
    PMP::polygon_soup_to_polygon_mesh(points, polygons, s);
    return s;
}

static PeerMesh from_surface(SurfaceMesh &s)
{
    PeerMesh m;
    s.collect_garbage();
    for (auto v : s.vertices()) m.point.emplace_back((float)s.point(v).x(), (float)s.point(v).y(), (float)s.point(v).z());
    for (auto f : s.faces()) {
        auto h = s.halfedge(f);
        m.triangle.emplace_back((uint32_t)s.source(h), (uint32_t)s.target(h), (uint32_t)s.target(s.next(h)));
    }
    return m;
}

static PeerMesh mesh(const openvdb::FloatGrid &grid, double iso, double edge, Laps &laps)
{
    PeerMesh m = volume_to_mesh(grid, iso, 0);
    laps.end("mesh");
    SurfaceMesh s = repair(m);
    laps.end("repair");
    PMP::isotropic_remeshing(s.faces(), edge, s, CGAL::parameters::number_of_iterations(ITERATIONS));
    m = from_surface(s);
    laps.end("remesh");
    return m;
}

int main(int argc, char **argv) { return peer_main(argc, argv, {"EDGE", nullptr, mesh}); }
