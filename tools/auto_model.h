// --model auto: a model and its settings for a wanted error, size or decoding cost, by measurement.
#pragma once
#include <string>

#include "encoder/model_table.h"
#include "tools/json.h"
#include "tools/measure_file.h"

namespace btfc {

enum class TargetKind { psnr, bytes, operations };

// At least so many dB; at most so many bytes of payload, or operations a texel in a shader.
struct Target {
  TargetKind kind = TargetKind::psnr;
  double value = 0;
};

// --psnr P, --bytes N or --decode-cost N, exactly one and nothing else.
Result<Target> target_of(const OptionValues& options);

struct AutomaticFit {
  const ModelFormat* model = nullptr;
  FitResult fitted;
  Json reasons;      // spec/command.md
  std::string text;  // the candidates as a table, and what became of the best
};

// Fits the ladders to a part of the input, and from that predicts for the whole what each family of settings
// gives; fits the best candidate, measures it, corrects its family's prediction by what was found, and goes
// on so until the best candidate has been fitted, four times at most. settings: without options. Fails where
// what is nearest to the target is not near enough: PSNR 0.5 dB below it, or bytes or operations above it.
Result<AutomaticFit> fit_automatically(const FitInput& input, const FitSettings& settings,
                                       const Target& target, const std::string& scratch_directory);

}  // namespace btfc
