// --scene for the verbs: a scene file applied to what is read and to what is written.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "encoder/model_table.h"
#include "encoder/scene/scene_file.h"

namespace btfc {

// The texels of an image that a scene keeps: all of them, or its region.
Result<Rectangle> scene_texels(const Scene& scene, std::uint32_t width, std::uint32_t height,
                               const std::string& what);

// Region, channels (by number, or R, G, B, A, Y) and footprints of a scene; one with directions is refused.
Result<Image> scene_image(const Scene& scene, const Image& image, const std::string& what);

// A scene's target as the option --psnr or --bytes; refused where one of them is given, or the model (null:
// the one that measurement chooses) has no such option.
Result<Done> apply_target(const Scene& scene, const ModelFormat* model, OptionValues& values);

}  // namespace btfc
