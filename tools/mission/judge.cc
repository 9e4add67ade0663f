#include "tools/mission/judge.h"

#include <malloc.h>

#include "tools/mission/evaluate.h"
#include "tools/report/report.h"

namespace vog {

nlohmann::ordered_json JudgeRun(const std::filesystem::path& folder) {
  malloc_trim(0);
  nlohmann::ordered_json metrics = EvaluateRun(folder);
  malloc_trim(0);
  WriteReport(folder);
  return metrics;
}

}  // namespace vog
