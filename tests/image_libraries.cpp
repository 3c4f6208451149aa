// Image libraries are loaded before the first test: what their initialisers keep for the process is no leak
// of a test, and now and then is taken for one.
#ifdef __SANITIZE_ADDRESS__
#include <gtest/gtest.h>
#include <sanitizer/lsan_interface.h>

#include "encoder/output/png_bytes.h"

namespace btfc::test {
namespace {

class ImageLibraries : public ::testing::Environment {
  void SetUp() override {
    const __lsan::ScopedDisabler libraries;
    Image grey;
    grey.width = grey.height = grey.channels = 1;
    grey.codes = {0};
    ASSERT_TRUE(png_bytes(grey));
  }
};

// Owned by the framework.
[[maybe_unused]] const ::testing::Environment* const kImageLibraries =
    ::testing::AddGlobalTestEnvironment(new ImageLibraries);

}  // namespace
}  // namespace btfc::test
#endif
