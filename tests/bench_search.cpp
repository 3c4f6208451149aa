// btfc_bench_search [IMAGE]: the fast patch search against the plain loop, in one run: same recipe, and the
// ratio of their times.
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "encoder/image_file.h"
#include "encoder/models/patch_synthesis.h"
#include "encoder/synth/texture_synth.h"

using namespace btfc;

// IMAGE's middle 128x128 texels (or a synthetic material) to 1024x1024, image quilting, w_B 48, w_E 8.
int main(int argc, char** argv) {
  TextureOptions options;
  options.width = options.height = 128;
  Result<Image> image = argc > 1 ? read_image(argv[1]) : synthesize_texture("pebbles", options);
  if (!image || image->width < 128 || image->height < 128) {
    std::fprintf(stderr, "btfc_bench_search: no image of 128x128 texels\n");
    return 1;
  }
  const Image sample = crop(*image, (image->width - 128) / 2, (image->height - 128) / 2, 128, 128);
  const PatchShape shape{128, 128, 26, 26, 48, 8, PatchBlend::quilting, CutLayout::packed, false, 0};
  SynthesisSettings settings;
  const auto seconds = [&](int threads, bool plain, PatchRecipe& recipe) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    settings.plain_search = plain;
    const auto begin = std::chrono::steady_clock::now();
    recipe = arena.execute([&] { return synthesize_patches(shape, {&sample, 1}, settings, {}); });
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  PatchRecipe plain, one, two;
  const double plain_seconds = seconds(1, true, plain);
  const double one_seconds = seconds(1, false, one), two_seconds = seconds(2, false, two);
  const bool same = plain == one && plain == two;
  std::printf(
      "plain loop, 1 thread  %8.3f s\nfast, 1 thread        %8.3f s  ratio %6.1f\nfast, 2 threads       "
      "%8.3f s  ratio %6.1f\nsame recipe: %s\n",
      plain_seconds, one_seconds, plain_seconds / one_seconds, two_seconds, plain_seconds / two_seconds,
      same ? "yes" : "NO");
  return same ? 0 : 1;
}
