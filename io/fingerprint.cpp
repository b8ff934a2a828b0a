#include "io/fingerprint.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <new>

#include "retarget/error.h"

namespace hydrostat::io {

namespace {

struct ContextDeleter {
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};
using Context = std::unique_ptr<EVP_MD_CTX, ContextDeleter>;

Context new_context() {
  Context context(EVP_MD_CTX_new());
  if (!context || EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
  return context;
}

std::string finish(EVP_MD_CTX* context) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned size = 0;
  EVP_DigestFinal_ex(context, digest.data(), &size);
  std::string hex;
  for (unsigned i = 0; i < size; ++i) {
    constexpr char kDigits[] = "0123456789abcdef";
    hex += kDigits[digest[i] >> 4];
    hex += kDigits[digest[i] & 15];
  }
  return hex;
}

}  // namespace

struct Fingerprint::State {
  Context context = new_context();
};

Fingerprint::Fingerprint() : state_(std::make_unique<State>()) {}
Fingerprint::~Fingerprint() = default;

void Fingerprint::add_bytes(std::string_view name, char kind, const void* bytes, std::size_t size) {
  const std::array<std::uint64_t, 2> sizes{name.size(), size};
  EVP_MD_CTX* context = state_->context.get();
  EVP_DigestUpdate(context, sizes.data(), sizeof(sizes));
  EVP_DigestUpdate(context, &kind, 1);
  EVP_DigestUpdate(context, name.data(), name.size());
  EVP_DigestUpdate(context, bytes, size);
}

Fingerprint& Fingerprint::add(std::string_view name, std::string_view text) {
  add_bytes(name, 't', text.data(), text.size());
  return *this;
}

Fingerprint& Fingerprint::add(std::string_view name, std::int64_t number) {
  add_bytes(name, 'n', &number, sizeof(number));
  return *this;
}

Fingerprint& Fingerprint::add(std::string_view name, double number) {
  add_bytes(name, 'd', &number, sizeof(number));
  return *this;
}

Fingerprint& Fingerprint::add(std::string_view name, const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::MatrixXd dense = matrix;  // a Ref may have gaps between its columns
  add(name, std::int64_t{dense.rows()});
  add_bytes(name, 'D', dense.data(), static_cast<std::size_t>(dense.size()) * sizeof(double));
  return *this;
}

Fingerprint& Fingerprint::add(std::string_view name, const Eigen::Ref<const Eigen::MatrixXi>& matrix) {
  const Eigen::MatrixXi dense = matrix;
  add(name, std::int64_t{dense.rows()});
  add_bytes(name, 'N', dense.data(), static_cast<std::size_t>(dense.size()) * sizeof(int));
  return *this;
}

std::string Fingerprint::hex() const {
  const Context copy = new_context();
  EVP_MD_CTX_copy_ex(copy.get(), state_->context.get());
  return finish(copy.get());
}

std::string sha256(std::string_view bytes) {
  const Context context = new_context();
  EVP_DigestUpdate(context.get(), bytes.data(), bytes.size());
  return finish(context.get());
}

std::string file_sha256(const std::filesystem::path& file) {
  const Context context = new_context();
  std::ifstream stream(file, std::ios::binary);
  std::array<char, 1 << 16> block;
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    EVP_DigestUpdate(context.get(), block.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (!stream.eof()) {
    throw Error(file.string(), "", "cannot be read", "Check the path and the permission to read it.");
  }
  return finish(context.get());
}

}  // namespace hydrostat::io
