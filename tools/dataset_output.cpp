// A data set as a directory, a file, or a picture.
#include "tools/dataset_output.h"

#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/output/btf_exr_write.h"
#include "encoder/output/ubo2003_write.h"
#include "tools/contact_sheet.h"
#include "tools/progress.h"

namespace btfc {

Result<Done> write_dataset(const Dataset& dataset, const std::string& path, const SheetOptions& sheet) {
  const std::string kind = file_extension(path);
  if (kind == "png") return write_image(path, contact_sheet(dataset, sheet.images, sheet.repeats));
  if (kind == "exr") return write_btf_exr(dataset, path, progress_line("writing"));
  return write_ubo2003(path, dataset);
}

}  // namespace btfc
