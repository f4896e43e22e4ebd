// Sequences of level sets for the benchmark: float grids "phi" of N^3 voxels in the unit cube, a narrow band of three voxels.
//
//   generate KIND N FRAMES DIR       writes DIR/phi.0001.vdb ...; the same samples on every run
//
//   splash   a pool with ripples and a crown, and drops that rise out of it, part, meet and fall back
//   sphere   a ball that moves and grows
//   still    the splash of the middle frame, at every frame
//
// Things move a voxel and a half a frame or so at any N, so that sizes differ in the area alone; the splash's shape scales
// with N, and its smallest drops are two voxels wide at N = 32.

#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3d;
using Leaf = FloatGrid::TreeType::LeafNodeType;

static constexpr int SIDE = 8; // of a leaf
static constexpr double BAND_VOX = 3, STEP_VOX = 1.5;

// What a distance may be within a block of samples.
struct Span {
    double lo, hi;
};

// Signed distances, or nearly: negative inside.
struct Shape {
    virtual ~Shape() = default;
    virtual Span bound(const Coord &block) const = 0; // of the 8^3 samples from here on
    virtual void fill(Leaf &leaf) const = 0;          // with the distances of all its samples
};

class Ball : public Shape {
public:
    Ball(int n, Vec3d centre, double radius) : n(n), centre(centre), radius(radius) {}
    Span bound(const Coord &block) const override
    {
        double d = at_point((block.asVec3d() + Vec3d(0.5 * (SIDE - 1))) / n), reach = 0.5 * (SIDE - 1) * std::sqrt(3.0) / n;
        return {d - reach, d + reach};
    }
    double at(const Coord &sample) const { return at_point(sample.asVec3d() / n); }
    void fill(Leaf &leaf) const override
    {
        for (openvdb::Index s = 0; s < Leaf::SIZE; s++) leaf.setValueOnly(s, (float)at(leaf.offsetToGlobalCoord(s)));
    }

private:
    double at_point(Vec3d p) const { return (p - centre).length() - radius; }
    int n;
    Vec3d centre;
    double radius;
};

// Minimum and maximum with a fillet of about k/4: nowhere farther than that from the sharp ones.
static double smooth_min(double a, double b, double k)
{
    double h = std::max(k - std::fabs(a - b), 0.0) / k;
    return std::min(a, b) - 0.25 * h * h * k;
}
static double smooth_max(double a, double b, double k) { return -smooth_min(-a, -b, k); }

// A number in [0, 1) for each i and salt.
static double draw(uint32_t i, uint32_t salt)
{
    uint32_t x = i * 0x9e3779b9u + salt * 0x85ebca6bu;
    x = (x ^ x >> 16) * 0x7feb352du;
    x = (x ^ x >> 15) * 0x846ca68bu;
    return (x ^ x >> 16) / 4294967296.0;
}

class Splash : public Shape {
public:
    Splash(int n, double time) : n(n)
    {
        make_water(time);
        throw_drops(time);
    }

    Span bound(const Coord &block) const override
    {
        Span all = bound_pool(block);
        for (const Ball &drop : drops) {
            Span d = drop.bound(block);
            all = {std::min(all.lo, d.lo), std::min(all.hi, d.hi)};
        }
        return {all.lo - NECK, all.hi}; // a fillet is a quarter of the neck; four of them meet in one place at most
    }

    void fill(Leaf &leaf) const override
    {
        std::vector<const Ball *> near;
        double farthest = bound(leaf.origin()).hi + NECK;
        for (const Ball &drop : drops)
            if (drop.bound(leaf.origin()).lo < farthest) near.push_back(&drop);
        for (openvdb::Index s = 0; s < Leaf::SIZE; s++) {
            Coord sample = leaf.offsetToGlobalCoord(s);
            double d = pool(sample);
            for (const Ball *drop : near) d = smooth_min(d, drop->at(sample), NECK);
            leaf.setValueOnly(s, (float)d);
        }
    }

private:
    static constexpr double LEVEL = 0.3, GRAVITY = 2, NECK = 0.02, EDGE = 0.03, HALF_WIDTH = 0.43, BOTTOM = 0.07;
    static constexpr uint32_t THROWS = 80;

    // Height of the water over (x, z): ripples, a swell, a crown that widens with nine fingers, and the jet in its middle.
    static double height(double x, double z, double t)
    {
        double r = std::hypot(x - 0.5, z - 0.5), angle = std::atan2(z - 0.5, x - 0.5);
        double ripples = 0.02 * std::exp(-2 * r) * std::cos(40 * r - 20 * t);
        double swell = 0.015 * std::sin(14 * x + 5 * z - 6 * t);
        double rim = (r - 0.12 - 0.12 * t) / 0.04;
        double crown = 0.15 * std::exp(-rim * rim) * (1 + 0.4 * std::cos(9 * angle + t));
        double jet = 0.22 * std::exp(-r * r / 0.003) * t;
        return LEVEL + ripples + swell + crown + jet;
    }

    // Per column: the height, and what turns a height above it into a distance, to first order.
    void make_water(double t)
    {
        level.resize((size_t)n * n);
        slant.resize((size_t)n * n);
        const double h = 0.25 / n;
        tbb::parallel_for(0, n, [&](int z) {
            for (int x = 0; x < n; x++) {
                double px = (double)x / n, pz = (double)z / n;
                double dx = (height(px + h, pz, t) - height(px - h, pz, t)) / (2 * h);
                double dz = (height(px, pz + h, t) - height(px, pz - h, t)) / (2 * h);
                level[(size_t)z * n + x] = height(px, pz, t);
                slant[(size_t)z * n + x] = 1 / std::sqrt(1 + dx * dx + dz * dz);
            }
        });
    }

    // Two balls a throw, of nearly the same velocity: they part on their way. They come out of the water and end in it.
    void throw_drops(double t)
    {
        for (uint32_t i = 0; i < THROWS; i++) {
            double angle = 2 * M_PI * draw(i, 0), out = 0.04 + 0.16 * draw(i, 1), up = 0.9 + 0.65 * draw(i, 2);
            double flown = t - 1.2 * draw(i, 3) + 0.2, from = 0.14 + 0.05 * draw(i, 4);
            for (uint32_t half = 0; half < 2; half++) {
                double speed = 1 - 0.15 * half, radius = 0.032 + 0.028 * draw(2 * i + half, 5);
                double r = from + out * speed * flown, y = LEVEL - 0.1 + up * speed * flown - 0.5 * GRAVITY * flown * flown;
                Vec3d centre(0.5 + r * std::cos(angle), y, 0.5 + r * std::sin(angle));
                if (flown > 0 && y > BOTTOM + 0.1) drops.emplace_back(n, centre, radius);
            }
        }
    }

    // The basin: a box with rounded edges, open at the top.
    double basin(const Vec3d &p) const
    {
        const double round = 0.05;
        Vec3d q(std::fabs(p.x() - 0.5) - HALF_WIDTH + round, BOTTOM + round - p.y(), std::fabs(p.z() - 0.5) - HALF_WIDTH + round);
        Vec3d beyond(std::max(q.x(), 0.0), std::max(q.y(), 0.0), std::max(q.z(), 0.0));
        return beyond.length() + std::min(std::max({q.x(), q.y(), q.z()}), 0.0) - round;
    }

    double pool(const Coord &c) const
    {
        size_t column = (size_t)c.z() * n + c.x();
        return smooth_max(((double)c.y() / n - level[column]) * slant[column], basin(c.asVec3d() / n), EDGE);
    }

    Span bound_pool(const Coord &block) const
    {
        Span water = {INFINITY, -INFINITY};
        for (int z = block.z(); z < block.z() + SIDE; z++)
            for (int x = block.x(); x < block.x() + SIDE; x++) {
                size_t column = (size_t)z * n + x;
                water.lo = std::min(water.lo, ((double)block.y() / n - level[column]) * slant[column]);
                water.hi = std::max(water.hi, ((double)(block.y() + SIDE - 1) / n - level[column]) * slant[column]);
            }
        double wall = basin((block.asVec3d() + Vec3d(0.5 * (SIDE - 1))) / n), reach = 0.5 * (SIDE - 1) * std::sqrt(3.0) / n;
        return {std::max(water.lo, wall - reach), std::max(water.hi, wall + reach) + 0.25 * EDGE};
    }

    int n;
    std::vector<double> level, slant; // [n*n] by z, x
    std::vector<Ball> drops;
};

static FloatGrid::Ptr sample(const Shape &shape, int n)
{
    const float band = (float)(BAND_VOX / n);
    const int blocks = n / SIDE;
    auto grid = FloatGrid::create(band);
    grid->setName("phi");
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0 / n));
    std::vector<std::unique_ptr<Leaf>> leaf((size_t)blocks * blocks * blocks);
    tbb::parallel_for((size_t)0, leaf.size(), [&](size_t i) {
        Coord block((int)(i % blocks) * SIDE, (int)(i / blocks % blocks) * SIDE, (int)(i / blocks / blocks) * SIDE);
        Span span = shape.bound(block);
        if (span.lo >= band || span.hi <= -band) return;
        auto made = std::make_unique<Leaf>(block);
        shape.fill(*made);
        for (openvdb::Index s = 0; s < Leaf::SIZE; s++) {
            float d = made->getValue(s);
            if (std::fabs(d) < band) made->setValueOn(s);
            else made->setValueOff(s, std::copysign(band, d));
        }
        if (!made->isEmpty()) leaf[i] = std::move(made);
    });
    for (auto &l : leaf)
        if (l) grid->tree().addLeaf(l.release());
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

// `f` counts frames from the middle one.
static std::unique_ptr<Shape> shape_at(const std::string &kind, int n, int f)
{
    const double way = STEP_VOX * f / n;
    if (kind == "splash") return std::make_unique<Splash>(n, 0.7 + way);
    if (kind == "still") return std::make_unique<Splash>(n, 0.7);
    if (kind == "sphere") return std::make_unique<Ball>(n, Vec3d(0.5) + way * Vec3d(0.5, 0.3, 0.2), 0.4 + 0.15 * way);
    return nullptr;
}

int main(int argc, char **argv)
{
    int n = argc == 5 ? std::atoi(argv[2]) : 0, frames = argc == 5 ? std::atoi(argv[3]) : 0;
    if (n < 32 || n > 1024 || n % SIDE != 0 || frames < 1 || !shape_at(argv[1], n, 0)) {
        std::fprintf(stderr, "generate splash|sphere|still N FRAMES DIR: N from 32 to 1024, a multiple of %d\n", SIDE);
        return 2;
    }
    openvdb::initialize();
    try {
        for (int f = 0; f < frames; f++) {
            char name[32];
            std::snprintf(name, sizeof name, "/phi.%04d.vdb", f + 1);
            openvdb::io::File(std::string(argv[4]) + name).write({sample(*shape_at(argv[1], n, f - frames / 2), n)});
        }
    } catch (const std::exception &e) {
        std::fprintf(stderr, "generate: %s: %s\n", argv[4], e.what());
        return 4;
    }
    return 0;
}
