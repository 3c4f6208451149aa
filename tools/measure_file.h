// What a file is worth under settings of its run-time knobs: errors against what it was made from, cost and
// rate.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "encoder/metrics/texture_distance.h"
#include "encoder/model_table.h"
#include "format/container.h"
#include "format/quality_curve.h"
#include "tools/decode_rates.h"
#include "tools/texture_file.h"

namespace btfc {

// Nothing where a measure says nothing of the input or of the model.
struct MeasuredError {
  std::optional<double> psnr_db, mae_lab, ssim, flip;     // texel by texel
  std::optional<double> brdf_rmse_8bit, colour_distance;  // of a BTF, also where texels do not stay in place
  std::optional<double> texture_distance;                 // of an image: texture_distance_of
};

// How far a texture is from a material that it need not be aligned with: the mean of the ratios of
// TextureDistances, that of STSIM-2 among them. 1: as another sample of the material.
double texture_distance_of(const TextureDistances& distances);

// What files are held against. Of a data set every n-th pair is measured, for SSIM and FLIP far fewer; of
// images the first map.
class Reference {
 public:
  static Result<Reference> of(const FitInput& input, const std::string& scratch_directory);

  // keeps_texels: of the model; where it does not, errors texel by texel are not measured.
  // all: also the slower measures, SSIM, FLIP and MAE in Lab.
  Result<MeasuredError> measure(const Head& head, const btfc_texture* texture, bool keeps_texels,
                                bool all) const;
  bool btf() const { return pairs_.has_value(); }
  std::uint32_t measured_pairs() const { return pairs_ ? count(*pairs_) : 1; }
  std::uint32_t looked_at_pairs() const { return few_ ? count(*few_) : 1; }

  // 8-bit RGB for looking at: one pair, of large images the middle.
  Image picture() const;
  Result<Image> picture(const Head& head, const btfc_texture* texture) const;

 private:
  static std::uint32_t count(const Dataset& d) { return static_cast<std::uint32_t>(d.info().pairs.size()); }
  std::optional<Dataset> pairs_, few_, shown_;
  std::optional<TextureReference> image_;  // without a BTF
  std::string scratch_;
};

// The one number that a model is judged by, the smaller the better: -psnr_db, or a distance.
std::optional<double> judged(const MeasuredError& error, bool keeps_texels);
// Its name: "psnr_db", "texture_distance", …
const char* judged_by(const MeasuredError& error, bool keeps_texels);

// A file as it is with one setting of its run-time knobs.
struct MeasuredSetting {
  Knobs knobs;
  std::uint64_t payload_bytes = 0;  // of the levels that are read
  std::uint64_t file_bytes = 0;     // up to the end of the last of them
  MeasuredError error;
  std::optional<TexelCost> cost;  // in a shader; of textures that can be prepared, of a texel that is
  DecodeRates rates;
  std::optional<DeviceRates> device;
  Image picture;  // empty where none was wanted
};

struct MeasureOptions {
  double rate_seconds = 0.1;  // for each rate; 0: none is measured
  bool shader = false;        // also the shader's rates
  bool slow = false;          // also MAE in Lab, SSIM and FLIP
  bool pictures = false;
};

// A whole file under the settings that are worth a look: its own first; then fewer levels; then fewer gates;
// then more culling.
Result<std::vector<MeasuredSetting>> measure_settings(ByteView file, const Reference& reference,
                                                      const MeasureOptions& options);

// What QUAL says of them. Refused: no measure says anything.
Result<QualityCurve> curve_of(const std::vector<MeasuredSetting>& settings, const Reference& reference,
                              bool keeps_texels);

}  // namespace btfc
