// btfc scene: scene files made from what a camera sees.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "encoder/output/atomic_file.h"
#include "tools/command.h"
#include "tools/file_source.h"
#include "tools/scene_camera.h"

namespace btfc {
namespace {

struct SceneArguments {
  std::string input, output;
  Report report;
};

int from_camera(const SceneArguments& a) {
  const auto stop = [](const Error& e) { return fail("scene", e); };
  const Result<CameraSetup> setup = read_cameras(a.input);
  if (!setup) return stop(setup.error());
  const Result<SeenScene> seen = see(*setup);
  if (!seen) return stop(placed(a.input, seen.error()));
  const Json scene = scene_json(*seen, setup->most_pairs);
  const std::string text = scene.dump(1) + "\n";
  const ByteView bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  if (const auto wrote = write_file(a.output, bytes); !wrote) return stop(wrote.error());
  const Json json = {{"output", a.output},          {"frames", setup->frames.size()},
                     {"pixels", seen->pixels},      {"samples", seen->samples},
                     {"pairs", seen->pairs.size()}, {"joint", scene.contains("pairs")},
                     {"radius", scene["radius"]},   {"footprints", scene["footprints"]}};
  const std::string words = fmt::format(
      "{}: {} pairs of directions, {}, within {} degrees; footprints of {} to {} texels", a.output,
      seen->pairs.size(), scene.contains("pairs") ? "listed" : "listed as views and lights",
      scene["radius"].get<double>(), scene["footprints"][0].get<double>(),
      scene["footprints"][1].get<double>());
  const auto wrote = a.report.write(words, json);
  return wrote ? kExitOk : stop(wrote.error());
}

}  // namespace

Verb add_scene(CLI::App& app) {
  auto a = std::make_shared<SceneArguments>();
  CLI::App* verb = app.add_subcommand("scene", "files that say what a scene asks of a material (--scene)");
  verb->require_subcommand(1);
  CLI::App* from = verb->add_subcommand(
      "from-camera", "a scene file from cameras, lights and a plane, sphere or OBJ mesh (spec/scene.md)");
  from->add_option("CAMERAS.json", a->input, "cameras, lights and the surface")->required();
  from->add_option("-o,--output", a->output, "the scene file to write")->required()->type_name("SCENE.json");
  a->report.attach(*from);
  return {verb, [a] { return from_camera(*a); }};
}

}  // namespace btfc
