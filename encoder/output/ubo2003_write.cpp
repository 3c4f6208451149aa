// Images of a data set to files, in parallel, in a directory of their own.
#include "encoder/output/ubo2003_write.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "encoder/for_each_index.h"
#include "encoder/image_file.h"
#include "encoder/input/image_placement.h"
#include "encoder/input/ubo2003_name.h"

namespace btfc {
namespace {

Error failed(const char* what, const std::string& path) {
  return io_error(fmt::format("could not {} '{}': {}", what, path, std::strerror(errno)));
}

// A directory beside the target, removed with all in it unless it was committed.
class PendingDirectory {
 public:
  static Result<PendingDirectory> create(const std::string& target) {
    std::string clean = target;
    while (clean.size() > 1 && clean.back() == '/') clean.pop_back();
    struct stat found {};
    std::error_code error;
    const bool exists = lstat(clean.c_str(), &found) == 0;
    if (exists && !(S_ISDIR(found.st_mode) && std::filesystem::is_empty(clean, error) && !error)) {
      return io_error(
          fmt::format("could not write '{}': it exists, expected a new name or an empty directory", target));
    }
    const std::size_t slash = clean.find_last_of('/') + 1;
    std::string path = clean.substr(0, slash) + "." + clean.substr(slash).substr(0, 200) + ".XXXXXX";
    if (mkdtemp(path.data()) == nullptr) return failed("create a directory beside", target);
    // mkdtemp gives 0700; a directory has the mode that the user's mask asks for.
    const mode_t mask = umask(0);
    umask(mask);
    chmod(path.c_str(), 0777 & ~mask);
    return PendingDirectory(clean, path);
  }
  PendingDirectory(PendingDirectory&& other) noexcept
      : target_(std::move(other.target_)), path_(std::move(other.path_)) {
    other.path_.clear();
  }
  PendingDirectory& operator=(PendingDirectory&&) = delete;
  ~PendingDirectory() {
    std::error_code unknown;
    if (!path_.empty()) std::filesystem::remove_all(path_, unknown);
  }

  const std::string& path() const { return path_; }
  Result<Done> commit() {
    if (rename(path_.c_str(), target_.c_str()) != 0)
      return failed("rename the finished directory to", target_);
    path_.clear();
    return Done{};
  }

 private:
  PendingDirectory(std::string target, std::string path)
      : target_(std::move(target)), path_(std::move(path)) {}
  std::string target_, path_;
};

// The degrees of directions as names write them, "030" and "022.5"; no two may be alike.
struct DirectionText {
  std::string theta, phi;
};

Result<std::vector<DirectionText>> direction_texts(const std::vector<Direction>& directions,
                                                   const char* what) {
  std::vector<GridDirection> grid;
  std::vector<DirectionText> texts;
  for (const Direction& d : directions) {
    const GridDirection g =
        grid_direction(std::min(degrees(d.theta), 90.0), degrees(d.phi)).value_or(GridDirection{});
    grid.push_back(g);
    texts.push_back({ubo2003_angle_text(static_cast<double>(g.theta) * 1e-6),
                     ubo2003_angle_text(static_cast<double>(g.phi) * 1e-6)});
  }
  std::sort(grid.begin(), grid.end());
  const auto twice = std::adjacent_find(grid.begin(), grid.end());
  if (twice != grid.end()) {
    return bad_argument(fmt::format("two {} are {}, which the names of files do not tell apart", what,
                                    to_text(direction_of(*twice))));
  }
  return texts;
}

// What the readers take the files for must not contradict what the data set states.
Result<Done> check_colours(const DatasetInfo& info, bool png) {
  const ColourSpace space = info.colour_space;
  const ColourSpace taken_for = png ? ColourSpace::srgb_rec709_scene : ColourSpace::lin_rec709_scene;
  if (space == ColourSpace::unknown || space == ColourSpace::data || space == taken_for) return Done{};
  return bad_argument(fmt::format("the colours are {}, expected {} for {} files, which state no other",
                                  name_of(space), name_of(taken_for), png ? "PNG" : "EXR"));
}

}  // namespace

Result<Done> write_ubo2003(const std::string& path, const Dataset& dataset) {
  const DatasetInfo& info = dataset.info();
  const bool png = info.type != SampleType::float16 && info.channel_count() <= 4;
  if (const auto good = check_colours(info, png); !good) return good.error();
  const Result<std::vector<DirectionText>> views = direction_texts(info.views, "views");
  if (!views) return views.error();
  const Result<std::vector<DirectionText>> lights = direction_texts(info.lights, "lights");
  if (!lights) return lights.error();
  Result<PendingDirectory> pending = PendingDirectory::create(path);
  if (!pending) return pending.error();
  const auto folder_of = [&](const DirectionText& view) {
    return fmt::format("{}/tv{}_pv{}", pending->path(), view.theta, view.phi);
  };
  for (const DirectionText& view : *views) {
    const std::string folder = folder_of(view);
    if (mkdir(folder.c_str(), 0777) != 0) return failed("create", folder);
  }

  const Result<Done> written = for_each_index(info.pairs.size(), [&](std::size_t i) {
    const DirectionPair pair = info.pairs[i];
    const DirectionText &view = (*views)[pair.view], &light = (*lights)[pair.light];
    const std::string name = fmt::format("{}/{:05} tl{} pl{} tv{} pv{}.{}", folder_of(view),
                                         pair.light * info.views.size() + pair.view, light.theta, light.phi,
                                         view.theta, view.phi, png ? "png" : "exr");
    Image image = dataset.image(i);
    // PNG's second or fourth channel is alpha, and straight alpha is written as it is.
    if (png && image.channels % 2 == 0) image.alpha = Alpha::straight;
    return write_image(name, image, info.channels);
  });
  if (!written) return written.error();
  return pending->commit();
}

}  // namespace btfc
