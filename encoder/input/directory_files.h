// Listing the files of directories.
#pragma once
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "format/result.h"

namespace btfc {

// The regular files in a directory, and below it where recursive, sorted by path. Symbolic links to files are
// followed, those to directories are not: no loop can hang it.
Result<std::vector<std::string>> files_of_directory(const std::string& directory, bool recursive);

// Whether one of the first `limit` entries in or below a directory is a file with this property.
bool any_file_below(const std::string& directory, std::size_t limit,
                    const std::function<bool(const std::string& path)>& property);

bool is_directory(const std::string& path);

// "a/b.c.PNG": name "b.c.PNG", stem "b.c", extension "png". Only / divides.
std::string file_name(const std::string& path);
std::string file_stem(const std::string& path);
std::string file_extension(const std::string& path);
std::string lower_case(std::string_view text);

// jpg, jpeg, png, exr and hdr, and for sets of photographs tif and tiff too.
bool is_texture_file(const std::string& path);
bool is_photograph_file(const std::string& path);

// Whether a comes before b where runs of digits compare as numbers: "x.2" before "x.10".
bool natural_less(std::string_view a, std::string_view b);

}  // namespace btfc
