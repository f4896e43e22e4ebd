// peer.h: what the benchmark's peers have in common: a frame is read by OpenVDB, meshed, and written as a plain binary PLY.
//
//   PROGRAM THREADS GRID ISO PREFIX [PARAMETER] FILE...
//
// writes PREFIX.NNNN.ply, with the digits of FILE's name, and prints a line of JSON a file: its stages' seconds and its triangles.
#pragma once
#include <openvdb/openvdb.h>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

struct PeerMesh {
    std::vector<openvdb::Vec3s> point;      // world units
    std::vector<openvdb::Vec3I> triangle;   // of a level set counter-clockwise from outside
};

// Seconds of one stage after the other.
class Laps {
public:
    Laps() : last(Clock::now()) {}
    // Ends a stage, and begins the next.
    void end(const char *stage)
    {
        auto now = Clock::now();
        lap.emplace_back(stage, std::chrono::duration<double>(now - last).count());
        last = now;
    }
    std::vector<std::pair<std::string, double>> lap;

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point last;
};

struct Peer {
    const char *parameter;      // what it is called; nullptr: there is none
    void (*set_threads)(int n); // beside TBB's; nullptr: there are none
    PeerMesh (*mesh)(const openvdb::FloatGrid &grid, double iso, double parameter, Laps &laps);
};

// OpenVDB's volumeToMesh, its quads cut in two.
PeerMesh volume_to_mesh(const openvdb::FloatGrid &grid, double iso, double adaptivity);

// Returns the exit status.
int peer_main(int argc, char **argv, const Peer &peer);
