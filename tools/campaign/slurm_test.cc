#include "tools/campaign/slurm.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace vog {
namespace {

bool Has(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

TEST(SlurmTest, AnArrayForSbatch) {
  const std::vector<std::string> words = SbatchWords(
      "vog-1", {"--time=5", "--array=7", "--no-requeue"}, {"exec x", "/a 100%/log", 12, 3, ""});
  EXPECT_EQ(words.front(), "--wrap=exec x");
  EXPECT_TRUE(Has(words, "--output=/a 100%%/log"));
  EXPECT_TRUE(Has(words, "--job-name=vog-1"));
  // sbatch takes the last of a name.
  const auto at = [&](const std::string& word) {
    return std::find(words.begin(), words.end(), word) - words.begin();
  };
  EXPECT_LT(at("--requeue"), at("--no-requeue"));
  EXPECT_LT(at("--array=7"), at("--array=1-12%3"));
  EXPECT_TRUE(std::none_of(words.begin(), words.end(), [](const std::string& word) {
    return word.starts_with("--dependency");
  }));
}

TEST(SlurmTest, AJobAfterAnother) {
  const std::vector<std::string> words = SbatchWords("n", {}, {"exec x", "/log", 0, 3, "41"});
  EXPECT_TRUE(Has(words, "--dependency=afterany:41"));
  EXPECT_TRUE(std::none_of(words.begin(), words.end(),
                           [](const std::string& word) { return word.starts_with("--array"); }));
}

TEST(SlurmTest, FindsTheJobsNumber) {
  EXPECT_EQ(JobNumberIn("123\n"), "123");
  EXPECT_EQ(JobNumberIn("123;north\n"), "123");
  EXPECT_EQ(JobNumberIn("sbatch: lua: 7 nodes\nYour budget: 12 h\n123\n"), "123");
  for (const char* said : {"", "\n", "Submitted batch job 5\n", "-3\n", ";x\n", "12 13\n"})
    EXPECT_EQ(JobNumberIn(said), std::nullopt) << said;
}

TEST(SlurmTest, CountsTheQueue) {
  const SlurmQueue queue = ParseQueue(
      "slurm: note\nvog|1|RUNNING|None\nvog|2|PENDING|Resources\nvog|3|PENDING|Resources\n"
      "vog|4|COMPLETING|None\nvog|N/A|PENDING|Dependency\nvog|N/A|RUNNING|None\nvog|\nvog|1|X");
  EXPECT_EQ(queue.jobs, 6);
  EXPECT_EQ(queue.running, 2);
  EXPECT_EQ(queue.waiting_tasks, 2);
  EXPECT_EQ(queue.why_waiting, "Resources");
  EXPECT_EQ(ParseQueue("").jobs, 0);
}

TEST(SlurmTest, ComplaintsAreOneLine) {
  EXPECT_EQ(ComplaintIn("sbatch: error: no x\nsbatch: error: Batch job submission failed: y\n"),
            "no x; Batch job submission failed: y");
  EXPECT_EQ(ComplaintIn("slurm_load_jobs error: away\n\n"), "away");
  EXPECT_EQ(ComplaintIn(""), "");
}

TEST(SlurmTest, QuotesWords) {
  EXPECT_EQ(ShellQuoted("/a b"), "'/a b'");
  EXPECT_EQ(ShellQuoted("it's $(id)"), "'it'\\''s $(id)'");
}

}  // namespace
}  // namespace vog
