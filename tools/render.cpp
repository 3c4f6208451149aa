// btfc render: a lit shape that shows a texture, drawn by the texture's own fragment shader.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/input/text_numbers.h"
#include "encoder/run_on_threads.h"
#include "tools/command.h"
#include "tools/dataset_input.h"
#include "tools/environment.h"
#include "tools/exact_texture.h"
#include "tools/file_source.h"
#include "tools/progress.h"
#include "tools/render_shapes.h"
#include "tools/texture_file.h"
#include "tools/vulkan_render.h"

namespace btfc {
namespace {

constexpr std::uint32_t kMostSide = 4096;  // texels of an image that every device draws to

struct Arguments {
  std::string input, output, map, size = "512x512", repeat, env, shape = "sphere";
  std::vector<std::string> lights;
  std::optional<std::uint32_t> env_lights;
  std::uint32_t samples = 2, turntable = 0;
  double exposure = 0;
  bool validation = false;
  DatasetInput dataset;
  Report report;
};

std::optional<std::array<double, 2>> two_numbers(const std::string& text) {
  const std::size_t comma = std::min(text.find(','), text.size());
  const auto a = number_of(std::string_view(text).substr(0, comma));
  const auto b = comma < text.size() ? number_of(std::string_view(text).substr(comma + 1)) : std::nullopt;
  if (!a || !b) return std::nullopt;
  return std::array<double, 2>{*a, *b};
}

// ---- what is asked for

struct Size {
  std::uint32_t width, height;
};

Result<Size> picture_size(const Arguments& a) {
  const auto n = split_numbers(a.size, 'x');
  const std::uint32_t most = kMostSide / a.samples;
  if (!n || n->size() != 2 || (*n)[0] < 1 || (*n)[1] < 1 || (*n)[0] > most || (*n)[1] > most) {
    return bad_argument(fmt::format("--size is '{}', expected WxH, 1 to {} a side with --samples {}", a.size,
                                    most, a.samples));
  }
  return Size{(*n)[0], (*n)[1]};
}

// The viewer is on the axis z. In perspective a ball of radius 1 fills the shorter side but for a little;
// from afar the shape's length is the picture's, both ways.
constexpr double kViewer = 4, kHalfAngle = 15 * std::numbers::pi / 180, kNear = 2.5, kFar = 5.5;

// To the right and upwards, at the shape's middle.
std::array<double, 2> pixels_a_unit(const ShapeKind& kind, const Size& size) {
  if (kind.from_afar) return {size.width / kind.length_u, size.height / kind.length_v};
  const double both = std::min(size.width, size.height) / (2 * kViewer * std::tan(kHalfAngle));
  return {both, both};
}

// How often the texture lies on the shape: whole numbers that make its texels two pixels wide, or nearly.
Result<std::array<double, 2>> repeats(const Arguments& a, const ShapeKind& kind, const btfc_texture* texture,
                                      const std::array<double, 2>& pixels) {
  if (!a.repeat.empty()) {
    const auto n = two_numbers(a.repeat);
    if (!n || !((*n)[0] > 0) || !((*n)[1] > 0) || (*n)[0] > 1000 || (*n)[1] > 1000)
      return bad_argument(fmt::format("--repeat is '{}', expected U,V, above 0 and at most 1000", a.repeat));
    return *n;
  }
  const auto times = [](double length, std::uint32_t texels) {
    return std::max(1.0, std::round(length / (2.0 * texels)));
  };
  return std::array<double, 2>{times(kind.length_u * pixels[0], btfc_texture_width(texture)),
                               times(kind.length_v * pixels[1], btfc_texture_height(texture))};
}

Result<std::vector<RenderLight>> lights_of(const Arguments& a) {
  if (a.env_lights && a.env.empty()) return bad_argument("--env-lights is for --env");
  std::vector<RenderLight> lights;
  std::vector<std::string> named = a.lights;
  if (named.empty() && a.env.empty()) named = {"40,120"};
  for (const std::string& text : named) {
    const auto n = two_numbers(text);
    if (!n || (*n)[0] < 0 || (*n)[0] > 180) {
      return bad_argument(fmt::format(
          "--light is '{}', expected T,P: degrees from the axis towards the viewer, 0 to 180, and azimuth",
          text));
    }
    const Vector3 v = unit_vector(direction_from_degrees((*n)[0], (*n)[1]));
    RenderLight light{};
    for (std::size_t i = 0; i < 3; ++i) {
      light.direction[i] = static_cast<float>(v[i]);
      light.strength[i] = 1;
    }
    lights.push_back(light);
  }
  if (!a.env.empty()) {
    const Result<Image> image = read_image(a.env);
    if (!image) return image.error();
    const Result<std::vector<RenderLight>> more = environment_lights(*image, a.env_lights.value_or(64));
    if (!more) return placed(a.env, more.error());
    lights.insert(lights.end(), more->begin(), more->end());
  }
  for (RenderLight& light : lights) {
    for (std::size_t i = 0; i < 3; ++i) light.strength[i] *= static_cast<float>(std::exp2(a.exposure));
  }
  return lights;
}

// A file, or a data set as it is.
Result<ExactTexture> load_input(const Arguments& a) {
  if (!is_dataset(a.input)) {
    if (a.dataset.given())
      return bad_argument(
          fmt::format("'{}' is no data set: --crop, --missing and --scratch are for those", a.input));
    Result<Head> head = read_file_head(a.input);
    if (!head) return head.error();
    Result<TexturePtr> texture = load_texture(a.input);
    if (!texture) return texture.error();
    return ExactTexture{std::move(*head), std::move(*texture)};
  }
  Result<ExactTexture> made = bad_argument("");
  run_on_threads(a.dataset.threads, [&] {
    const Result<DatasetRead> read = a.dataset.read(a.input);
    if (!read) {
      made = read.error();
      return;
    }
    made = exact_texture(read->dataset);
    if (!made) made = placed(a.input, made.error());
  });
  return made;
}

// ---- the scene

// How the shader is to take a map's values.
void describe_values(const Head& head, const btfc_texture* texture, std::uint32_t map, RenderScene& scene) {
  const Map& m = head.maps[map];
  scene.channels = m.channels;
  scene.srgb_coded = m.colour_space == ColourSpace::srgb_rec709_scene ||
                     (m.colour_space == ColourSpace::unknown && m.type != SampleType::float16);
  // What is measured under lights has their cosine unless it says otherwise; what is not is an albedo.
  const bool measured = head.pairs > 1;
  scene.holds_cosine = measured && head.quantity != Quantity::reflectance;
  scene.cut_to_extent = !head.unbounded;
  constexpr float kLeast = 1e-3f;
  scene.least_view_z = scene.least_light_z = measured ? 1.0f : kLeast;
  float direction[3];
  for (std::uint32_t i = 0; measured && i < head.views; ++i) {
    btfc_texture_view(texture, i, direction);
    scene.least_view_z = std::max(kLeast, std::min(scene.least_view_z, direction[2]));
  }
  for (std::uint32_t i = 0; measured && i < head.lights; ++i) {
    btfc_texture_light(texture, i, direction);
    scene.least_light_z = std::max(kLeast, std::min(scene.least_light_z, direction[2]));
  }
}

// turn: of the shape about its own vertical axis, radians.
void place_shape(const ShapeKind& kind, const Size& size, double turn, RenderScene& scene) {
  const double tilt = kind.tilt * std::numbers::pi / 180;
  const double ct = std::cos(turn), st = std::sin(turn), cx = std::cos(tilt), sx = std::sin(tilt);
  // The tilt after the turn; rows.
  const double world[3][3] = {{ct, 0, st}, {sx * st, cx, -sx * ct}, {-cx * st, sx, cx * ct}};
  const std::array<double, 2> pixels = pixels_a_unit(kind, size);
  const double scale_x = 2 * pixels[0] / size.width, scale_y = 2 * pixels[1] / size.height;
  const double depth = kNear * kFar / (kFar - kNear);
  for (std::size_t column = 0; column < 4; ++column) {
    const auto at = [&](std::size_t row) { return column < 3 ? world[row][column] : 0.0; };
    const bool last = column == 3;
    // Vulkan's y goes down, its depth from 0 to 1.
    const double distance = (last ? kViewer : 0.0) - at(2);
    const double clip[4] = {scale_x * (kind.from_afar ? 1 : kViewer) * at(0),
                            -scale_y * (kind.from_afar ? 1 : kViewer) * at(1),
                            kind.from_afar ? (distance - (last ? kNear : 0.0)) / (kFar - kNear)
                                           : depth / kNear * distance - (last ? depth : 0.0),
                            kind.from_afar ? (last ? 1.0 : 0.0) : distance};
    for (std::size_t row = 0; row < 4; ++row) {
      scene.clip_from_object[4 * column + row] = static_cast<float>(clip[row]);
      scene.world_from_object[4 * column + row] = static_cast<float>(row < 3 ? at(row) : (last ? 1.0 : 0.0));
    }
  }
  scene.viewer[0] = scene.viewer[1] = 0;
  scene.viewer[2] = kind.from_afar ? 1 : static_cast<float>(kViewer);
  scene.viewer[3] = kind.from_afar ? 0 : 1;
}

// Means of samples x samples texels, on a neutral ground.
Image resolve(const std::vector<float>& picture, const Size& size, std::uint32_t samples) {
  constexpr double kGround = 0.08;
  Image image;
  image.width = size.width;
  image.height = size.height;
  image.channels = 3;
  image.type = SampleType::float16;
  image.colour_space = ColourSpace::lin_rec709_scene;
  image.codes.resize(std::size_t{3} * size.width * size.height);
  const std::size_t stride = std::size_t{size.width} * samples;
  for (std::uint32_t y = 0; y < size.height; ++y) {
    for (std::uint32_t x = 0; x < size.width; ++x) {
      std::array<double, 3> sum{};
      for (std::uint32_t i = 0; i < samples * samples; ++i) {
        const float* texel = &picture[4 * ((std::size_t{y} * samples + i / samples) * stride +
                                           std::size_t{x} * samples + i % samples)];
        for (std::size_t c = 0; c < 3; ++c) sum[c] += double{texel[c]} + (1 - double{texel[3]}) * kGround;
      }
      for (std::uint32_t c = 0; c < 3; ++c) {
        constexpr double kMostHalf = 65504;
        const double mean = std::min(sum[c] / (samples * samples), kMostHalf);
        image.at(x, y, c) = finite_half(static_cast<float>(mean)).value_or(0);
      }
    }
  }
  return image;
}

// OUT.png, or OUT-007.png of a turntable.
std::string frame_path(const Arguments& a, std::uint32_t frame) {
  if (a.turntable == 0) return a.output;
  const std::size_t dot = a.output.find_last_of('.');
  return fmt::format("{}-{:03}{}", a.output.substr(0, dot), frame, a.output.substr(dot));
}

int run(const Arguments& a) {
  const auto stop = [](const Error& e) { return fail("render", e); };
  const auto begin = std::chrono::steady_clock::now();
  if (const std::string kind = file_extension(a.output); kind != "png" && kind != "exr")
    return stop(bad_argument(fmt::format("'{}' names no output format, expected .png or .exr", a.output)));
  const Result<const ShapeKind*> kind = shape_kind(a.shape);
  if (!kind) return stop(kind.error());
  const Result<Size> size = picture_size(a);
  if (!size) return stop(size.error());
  const Result<std::vector<RenderLight>> lights = lights_of(a);
  if (!lights) return stop(lights.error());
  const Result<ExactTexture> input = load_input(a);
  if (!input) return stop(input.error());
  const btfc_texture* texture = input->texture.get();
  std::uint32_t map = 0;
  if (!a.map.empty()) {
    const Result<std::uint32_t> number = map_number(texture, a.map);
    if (!number) return stop(number.error());
    map = *number;
  }
  const auto repeat = repeats(a, **kind, texture, pixels_a_unit(**kind, *size));
  if (!repeat) return stop(repeat.error());

  VulkanOptions options;
  options.validation = a.validation;
  options.linear = true;
  if (input->head.unbounded) {
    // All that is seen, and what footprints at the border reach.
    constexpr std::int32_t kMargin = 64;
    const double width = std::ceil((*repeat)[0] * input->head.width) + 2 * kMargin;
    const double height = std::ceil((*repeat)[1] * input->head.height) + 2 * kMargin;
    options.window = {-kMargin, -kMargin, static_cast<std::uint32_t>(width),
                      static_cast<std::uint32_t>(height)};
  }
  const ShapeMesh mesh = make_mesh(**kind, (*repeat)[0], (*repeat)[1]);
  Result<VulkanRenderer> renderer =
      VulkanRenderer::open(texture, options, mesh, map, size->width * a.samples, size->height * a.samples);
  if (!renderer && renderer.error().status == Status::limit) {
    return stop(
        Error{Status::limit,
              fmt::format("'{}' is unbounded, and its window of {}x{} texels does not fit into the device's "
                          "buffers: choose a smaller --repeat than {},{}",
                          a.input, options.window.width, options.window.height, (*repeat)[0], (*repeat)[1]),
              "", 0});
  }
  if (!renderer) return stop(renderer.error());
  RenderScene scene{};
  describe_values(input->head, texture, map, scene);
  Json files = Json::array();
  const std::uint32_t frames = std::max(a.turntable, 1u);
  const auto progress = progress_line("rendering");
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    place_shape(**kind, *size, 2 * std::numbers::pi * frame / frames, scene);
    const Result<std::vector<float>> picture = renderer->picture(scene, *lights);
    if (!picture) return stop(picture.error());
    const std::string path = frame_path(a, frame);
    if (const auto wrote = write_image(path, resolve(*picture, *size, a.samples)); !wrote)
      return stop(wrote.error());
    files.push_back(path);
    if (progress) progress(frame + 1, frames);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const Json json = {{"files", files},           {"device", renderer->device_name()},
                     {"seconds", seconds},       {"shape", a.shape},
                     {"width", size->width},     {"height", size->height},
                     {"lights", lights->size()}, {"repeat", *repeat}};
  const std::string text = fmt::format(
      "{}: {}, {}x{}, {} light{}, {} frame{}, {:.2f} s", a.output, a.shape, size->width, size->height,
      lights->size(), lights->size() == 1 ? "" : "s", frames, frames == 1 ? "" : "s", seconds);
  if (const auto wrote = a.report.write(text, json); !wrote) return stop(wrote.error());
  return a.validation ? validation_result("render", renderer->messages()) : kExitOk;
}

}  // namespace

Verb add_render(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("render", "draw a lit shape that shows a texture, on a Vulkan device");
  verb->add_option("IN", a->input, "a .btfc file, or a data set (see convert), which is shown without loss")
      ->required();
  verb->add_option("-o,--output", a->output, "the picture to write: sRGB-coded PNG or linear EXR")
      ->required()
      ->type_name("OUT.png|.exr");
  std::string shapes;
  for (const ShapeKind& kind : shape_kinds())
    shapes += fmt::format("{}{}: {}", shapes.empty() ? "" : "; ", kind.name, kind.summary);
  verb->add_option("--shape", a->shape, shapes + " (default sphere)")->type_name("NAME");
  verb->add_option(
          "--light", a->lights,
          "a light in degrees: from the axis towards the viewer, and azimuth from the picture's right "
          "towards its top; may be repeated (default 40,120). A white diffuse surface that faces it shows 1")
      ->type_name("T,P")
      ->take_all()
      ->allow_extra_args(false);
  verb->add_option(
          "--env", a->env,
          "an environment of latitude and longitude in place of, or beside, lights; its middle lies behind "
          "the shape")
      ->type_name("FILE.hdr|.exr");
  verb->add_option("--env-lights", a->env_lights, "lights that stand for the environment (default 64)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  verb->add_option("--exposure", a->exposure, "stops by which the picture is brighter (default 0)")
      ->check(CLI::Range(-20.0, 20.0))
      ->type_name("EV");
  verb->add_option("--size", a->size, "of the picture (default 512x512)")->type_name("WxH");
  verb->add_option("--samples", a->samples, "samples of a pixel along each side (default 2)")
      ->check(CLI::Range(1, 8))
      ->type_name("N");
  verb->add_option("--repeat", a->repeat,
                   "how often the texture lies on the shape (default: so that texels are about two pixels)")
      ->type_name("U,V");
  verb->add_option("--turntable", a->turntable, "so many pictures OUT-000.png … of one turn of the shape")
      ->check(CLI::Range(1, 1000))
      ->type_name("N");
  verb->add_option("--map", a->map, "the map to show (default: the first)")->type_name("NAME");
  verb->add_flag("--validation", a->validation,
                 "with the Vulkan validation layer; what it says is a failure");
  a->dataset.attach(*verb);
  a->report.attach(*verb);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
