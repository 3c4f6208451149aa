// The refined fit of model gm: gradient descent on the squared error of the conditional expectation, with the
// gates, the shears and the rounding in the loop, over components that are split where the error is.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "encoder/models/gm_samples.h"
#include "format/bytes.h"
#include "format/models/gm_mixture.h"

namespace btfc {

// Where the fit stands.
struct GmProgress {
  std::uint64_t iteration = 0, iterations = 0;  // iterations is 0 while only a time is given
  double seconds = 0;
  double psnr_db = 0;            // of the samples drawn since the last report, as the fit sees them
  std::uint32_t components = 0;  // so far
  double listed = 0;             // components looked at for a sample, mean
};

struct GmRefinedOptions {
  std::uint32_t components = 600;
  std::uint64_t iterations = 0;  // steps of descent; 0: as many as the time allows
  double seconds = 60;           // where iterations is 0
  std::uint32_t gates = 0;       // K; 0: all
  bool shear = true;
  Precision precision = Precision::u8;
  std::uint64_t seed = 1;
  float rate = 1;                                   // on all steps of descent
  std::uint32_t visits = 32;                        // rectangles an iteration
  std::uint32_t pairs_per_visit = 4;                // pairs each is seen under
  std::uint32_t first_components = 0;               // before splitting; 0: half
  std::uint32_t split_every = 150;                  // iterations
  float growth = 1.1f;                              // components after a split, over those before
  float reach = 6;                                  // culling in the descent, powers of two
  std::function<void(const GmProgress&)> progress;  // now and then
  // A fit that was cut off goes on from the last state that was saved, and gives the same. save is called
  // when so many seconds have gone by, where the state is small.
  std::function<void(const Bytes& state)> save;
  double save_seconds = 20;
  Bytes resume;
};

struct GmRefined {
  GmCodes codes;                 // components by falling energy
  std::vector<double> energy;    // a component's share of the samples of the last steps, falling
  std::uint64_t iterations = 0;  // that give the same again
  std::uint64_t samples = 0;     // texels times pairs that were looked at
};

// samples.mean is set. On the threads of the calling oneTBB arena; the result does not depend on them, for a
// given number of iterations. None where `resume` is not the state of a fit with these options.
std::optional<GmRefined> gm_fit_refined(const GmSamples& samples, const GmRefinedOptions& options);

}  // namespace btfc
