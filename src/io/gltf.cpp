/* The shim over tinygltf: tables in, JSON text out. No C++ type or exception leaves. */
#include <cstring>
#include <exception>
#include <new>
#include <sstream>
#include <string>
#include <tiny_gltf.h>

extern "C" {
#include "io/gltf_priv.h"
}

namespace
{

void add_views(tinygltf::Model &model, const GltfDoc &doc)
{
    std::vector<uint64_t> start(1, 0); /* of each part in the one buffer */
    for (int p = 0; p < doc.npart; p++) start.push_back(start.back() + doc.part_bytes[p]);
    for (int i = 0; i < doc.nview; i++) {
        const GltfView &from = doc.view[i];
        tinygltf::BufferView view;
        view.buffer = doc.one_buffer ? 0 : from.part;
        view.byteOffset = from.offset + (doc.one_buffer ? start[size_t(from.part)] : 0);
        view.byteLength = from.bytes;
        view.byteStride = size_t(from.stride);
        view.target = from.target;
        model.bufferViews.push_back(view);
    }
}

void add_accessors(tinygltf::Model &model, const GltfDoc &doc)
{
    static const int type[] = {0, TINYGLTF_TYPE_SCALAR, TINYGLTF_TYPE_VEC2, TINYGLTF_TYPE_VEC3};
    for (int i = 0; i < doc.naccessor; i++) {
        const GltfAccessor &from = doc.accessor[i];
        tinygltf::Accessor accessor;
        accessor.bufferView = from.view;
        accessor.byteOffset = from.offset;
        accessor.componentType = from.component;
        accessor.type = type[from.width];
        accessor.count = size_t(from.count);
        if (from.has_range) {
            accessor.minValues.assign(from.lo, from.lo + from.width);
            accessor.maxValues.assign(from.hi, from.hi + from.width);
        }
        model.accessors.push_back(accessor);
    }
}

tinygltf::Mesh make_mesh(const GltfDoc &doc, const GltfPiece &piece)
{
    const GltfRun &run = doc.run[piece.run];
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.indices = run.index;
    primitive.attributes["POSITION"] = piece.position;
    primitive.attributes["NORMAL"] = piece.normal;
    primitive.attributes["_ID"] = run.id;
    if (piece.velocity != NONE) primitive.attributes["_VELOCITY"] = piece.velocity;
    for (int a = run.attr; a < run.attr + run.nattr; a++)
        primitive.attributes[doc.attr[a].name] = doc.attr[a].accessor;
    for (int k = 0; k < piece.ntarget; k++)
        primitive.targets.push_back(
            {{"POSITION", piece.target + 2 * k}, {"NORMAL", piece.target + 2 * k + 1}});

    tinygltf::Mesh mesh;
    mesh.primitives.push_back(primitive);
    return mesh;
}

/* Only the first piece is visible to a viewer that plays no animation. */
void add_nodes(tinygltf::Model &model, const GltfDoc &doc)
{
    tinygltf::Scene scene;
    scene.name = doc.name;
    for (int i = 0, within = 0; i < doc.npiece; i++) {
        const GltfPiece &piece = doc.piece[i];
        within = i && doc.piece[i - 1].run == piece.run ? within + 1 : 0;
        model.meshes.push_back(make_mesh(doc, piece));
        tinygltf::Node node;
        node.mesh = i;
        node.name = std::string(doc.name) + "_" + std::to_string(piece.run) +
                    (within ? "_" + std::to_string(within) : "");
        if (i) node.scale.assign(3, 0.0);
        model.nodes.push_back(node);
        scene.nodes.push_back(i);
    }
    model.scenes.push_back(scene);
    model.defaultScene = 0;
}

void add_channel(tinygltf::Animation &animation, int node, const char *path, int input, int output, bool step)
{
    if (input == NONE) return;
    tinygltf::AnimationSampler sampler;
    sampler.input = input;
    sampler.output = output;
    sampler.interpolation = step ? "STEP" : "LINEAR";
    tinygltf::AnimationChannel channel;
    channel.sampler = int(animation.samplers.size());
    channel.target_node = node;
    channel.target_path = path;
    animation.samplers.push_back(sampler);
    animation.channels.push_back(channel);
}

void add_animation(tinygltf::Model &model, const GltfDoc &doc)
{
    tinygltf::Animation animation;
    for (int i = 0; i < doc.npiece; i++) {
        const GltfPiece &piece = doc.piece[i];
        add_channel(animation, i, "weights", piece.weights_in, piece.weights_out, doc.step);
        add_channel(animation, i, "scale", piece.scale_in, piece.scale_out, true);
    }
    if (!animation.channels.empty()) model.animations.push_back(animation);
}

std::string make_json(const GltfDoc &doc)
{
    tinygltf::Model model;
    model.asset.version = "2.0";
    model.asset.generator = "twinmesh";
    add_views(model, doc);
    add_accessors(model, doc);
    add_nodes(model, doc);
    add_animation(model, doc);

    std::ostringstream stream;
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model, stream, false, false)) return "";
    std::string text = stream.str();
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
}

} // namespace

extern "C" char *gltf_make_json(const GltfDoc *doc, Err *err)
{
    try {
        std::string text = make_json(*doc);
        if (!text.empty()) return mem_text(text.c_str());
        fail(err, ERR_OUTPUT, "%s: tinygltf could not write the JSON of the animation", doc->name);
    } catch (const std::bad_alloc &) {
        fail(err, ERR_RESOURCE,
             "%s: out of memory for the JSON of the animation; write fewer frames to a file", doc->name);
    } catch (const std::exception &e) {
        fail(err, ERR_OUTPUT, "%s: the JSON of the animation could not be made: %.400s", doc->name, e.what());
    } catch (...) {
        fail(err, ERR_OUTPUT, "%s: the JSON of the animation could not be made", doc->name);
    }
    return nullptr;
}
