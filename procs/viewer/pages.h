#pragma once

#include <map>
#include <string>

namespace vog {

/// A file that is served as it is.
struct PageFile {
  std::string type;  ///< MIME type.
  std::string content;
};

/// The page's files, by their paths: the build bundles them from web/ and puts them into the
/// program.
const std::map<std::string, PageFile>& EmbeddedPages();

}  // namespace vog
