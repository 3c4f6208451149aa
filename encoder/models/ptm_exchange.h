// Model ptm and .ptm files.
#pragma once
#include "encoder/model_table.h"

namespace btfc {

// A .ptm file -> chunks: one view and, as the record, one light, both along the normal. PTM_FORMAT_RGB keeps
// its bytes unless another precision than u8 is asked for; PTM_FORMAT_LRGB is multiplied out (default f32).
Result<FitResult> ptm_import(const std::string& path, const FitSettings& settings);

// Chunks -> a .ptm file of PTM_FORMAT_RGB. For items with one view and one map of 1 or 3 channels; one
// channel becomes three alike. Bytes of a .ptm file that was imported come back as they were; other
// coefficients are coded anew, with the scale and bias that the three channels share.
Result<Bytes> ptm_export(const Head& head, ByteView parm, const ChunkReader& read);

}  // namespace btfc
