// btfc_range_table [DATA_DIR]: how near range maps come to surfaces that are known, by the robust method and
// by plain least squares: photographed balls where the data are, and synthetic materials.
#include <chrono>
#include <cstdio>

#include "tests/range_support.h"

using namespace btfc;
using namespace btfc::test;

namespace {

constexpr StereoMethod kMethods[] = {StereoMethod::robust, StereoMethod::least_squares};
const char* name_of_method(StereoMethod m) { return m == StereoMethod::robust ? "robust" : "plain"; }

struct Ball {
  const char *folder, *mask;
  bool linear_codes;
};
constexpr Ball kBalls[] = {{"photometric_diligent_ball96", "photometric_diligent_ball96/mask.png", false},
                           {"photometric_uw/gray", "photometric_uw/gray/gray.mask.png", true}};

bool ball_rows(const std::filesystem::path& data) {
  std::printf("%-28s %-7s %10s %10s %8s\n", "ball", "method", "mean deg", "median deg", "s");
  bool good = true;
  for (const Ball& ball : kBalls) {
    if (!std::filesystem::exists(data / ball.mask)) {
      std::printf("%-28s skipped: no %s\n", ball.folder, (data / ball.mask).c_str());
      continue;
    }
    for (const StereoMethod method : kMethods) {
      const auto begin = std::chrono::steady_clock::now();
      const Result<AngularError> error =
          ball_error(data / ball.folder, data / ball.mask, {method, ball.linear_codes});
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (!error) {
        std::fprintf(stderr, "btfc_range_table: %s\n", error.error().message.c_str());
        good = false;
        continue;
      }
      std::printf("%-28s %-7s %10.2f %10.2f %8.2f\n", ball.folder, name_of_method(method), error->mean,
                  error->median, seconds);
    }
  }
  return good;
}

bool material_rows() {
  std::printf("\n%-28s %-7s %11s %11s %11s %11s\n", "material, 64x64", "method", "correlation", "RMSE texel",
              "scale", "relief rms");
  BtfSynthOptions options;
  options.type = SampleType::float16;
  for (const BtfKind& kind : btf_kinds()) {
    const Result<Dataset> dataset = synthesize_btf(kind.name, options);
    if (!dataset) {
      std::fprintf(stderr, "btfc_range_table: %s\n", dataset.error().message.c_str());
      return false;
    }
    const std::vector<double> truth = true_heights(kind.name, options);
    for (const StereoMethod method : kMethods) {
      const Result<RangeMap> map =
          estimate_range_map(*dataset, options.width, options.height, {method, false});
      if (!map) {
        std::fprintf(stderr, "btfc_range_table: %s\n", map.error().message.c_str());
        return false;
      }
      const HeightError error = height_error(map->heights, truth);
      std::printf("%-28s %-7s %11.3f %11.3f %11.3f %11.3f\n", kind.name, name_of_method(method),
                  error.correlation, error.rmse, error.scale, error.relief);
    }
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const bool balls = ball_rows(argc > 1 ? std::filesystem::path(argv[1]) : range_data_folder());
  return material_rows() && balls ? 0 : 1;
}
