// Names in BTF files of OpenEXR parts (spec/interchange.md), for reader and writer.
#pragma once

namespace btfc {

inline constexpr int kBtfExrVersion = 1;

// Of the first part.
inline constexpr const char* kBtfExrVersionName = "btfc:version";
inline constexpr const char* kBtfExrSampleType = "btfc:sampleType";
inline constexpr const char* kBtfExrQuantity = "btfc:quantity";
inline constexpr const char* kBtfExrColourSpace = "btfc:colourSpace";
inline constexpr const char* kBtfExrWraps = "btfc:wraps";
inline constexpr const char* kBtfExrChannels = "btfc:channels";
// Of every part.
inline constexpr const char* kBtfExrView = "btfc:view";
inline constexpr const char* kBtfExrLight = "btfc:light";
inline constexpr const char* kBtfExrPair = "btfc:pair";

}  // namespace btfc
