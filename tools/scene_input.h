// --scene for the verbs: a scene file applied to what is read and to what is written.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "encoder/model_table.h"
#include "encoder/scene/scene_file.h"
#include "tools/command.h"

namespace btfc {

// The texels of an image that a scene keeps: all of them, or its region.
Result<Rectangle> scene_texels(const Scene& scene, std::uint32_t width, std::uint32_t height,
                               const std::string& what);

// Region, channels (by number, or R, G, B, A, Y) and footprints of a scene; one with directions is refused.
Result<Image> scene_image(const Scene& scene, const Image& image, const std::string& what);

// A scene's target as the option of a model that has one; refused where it has none, or the option is given.
Result<Done> apply_target(const Scene& scene, const ModelFormat& model, std::span<const OptionSpec> options,
                          OptionValues& values);

}  // namespace btfc
