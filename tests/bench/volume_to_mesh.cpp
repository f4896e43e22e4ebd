// OpenVDB's own mesher.
#include "peer.h"

static PeerMesh mesh(const openvdb::FloatGrid &grid, double iso, double adaptivity, Laps &laps)
{
    PeerMesh m = volume_to_mesh(grid, iso, adaptivity);
    laps.end("mesh");
    return m;
}

int main(int argc, char **argv) { return peer_main(argc, argv, {"ADAPTIVITY", nullptr, mesh}); }
