// VTK's flying edges, which want the samples as a dense box: making that is a stage of its own, "densify".
#include "peer.h"

#include <openvdb/tools/Dense.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSMPTools.h>

// The active box and a sample all around it.
static void densify(const openvdb::FloatGrid &grid, vtkImageData *image)
{
    openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    box.expand(1);
    openvdb::Coord n = box.dim();
    openvdb::Vec3d origin = grid.indexToWorld(box.min()), step = grid.voxelSize();
    image->SetDimensions(n.x(), n.y(), n.z());
    image->SetOrigin(origin.x(), origin.y(), origin.z());
    image->SetSpacing(step.x(), step.y(), step.z());
    vtkNew<vtkFloatArray> samples;
    samples->SetNumberOfValues((vtkIdType)box.volume());
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, samples->GetPointer(0));
    openvdb::tools::copyToDense(grid, dense);
    image->GetPointData()->SetScalars(samples);
}

static PeerMesh from_polydata(vtkPolyData *poly)
{
    PeerMesh m;
    for (vtkIdType v = 0; v < poly->GetNumberOfPoints(); v++) {
        double p[3];
        poly->GetPoint(v, p);
        m.point.emplace_back((float)p[0], (float)p[1], (float)p[2]);
    }
    vtkCellArray *cells = poly->GetPolys();
    vtkIdType n;
    const vtkIdType *corner;
    for (cells->InitTraversal(); cells->GetNextCell(n, corner);)
        m.triangle.emplace_back((uint32_t)corner[0], (uint32_t)corner[1], (uint32_t)corner[2]);
    return m;
}

static PeerMesh mesh(const openvdb::FloatGrid &grid, double iso, double, Laps &laps)
{
    vtkNew<vtkImageData> image;
    densify(grid, image);
    laps.end("densify");
    vtkNew<vtkFlyingEdges3D> edges;
    edges->SetInputData(image);
    edges->SetValue(0, iso);
    edges->ComputeNormalsOff();
    edges->ComputeGradientsOff();
    edges->ComputeScalarsOff();
    edges->Update();
    PeerMesh m = from_polydata(edges->GetOutput());
    laps.end("mesh");
    return m;
}

static void set_threads(int n) { vtkSMPTools::Initialize(n); }

int main(int argc, char **argv) { return peer_main(argc, argv, {nullptr, set_threads, mesh}); }
