// Correspondence at a point against OpenCV: costs against absdiff, norm, dot and matchTemplate, and
// the place found against the extreme of matchTemplate, on random pairs whose right image is the
// left one shifted, brightened and noisy. Exits 1 and prints the first difference of each kind.
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

extern "C" {
#include "vision/correspondence.h"
}

namespace
{

constexpr int kWidth = 120;
constexpr int kHeight = 48;
constexpr int kSearch = 40;
constexpr int kTrials = 400;

image_view_t view_of(const cv::Mat &image)
{
    return {image.data, static_cast<uint16_t>(image.cols), static_cast<uint16_t>(image.rows),
            static_cast<uint16_t>(image.step)};
}

struct Pair {
    cv::Mat left;
    cv::Mat right;
};

Pair make_pair(cv::RNG &random)
{
    Pair pair;
    cv::Mat noise(kHeight, kWidth, CV_8U);
    const int shift = random.uniform(0, kSearch - 4);
    pair.left.create(kHeight, kWidth, CV_8U);
    random.fill(pair.left, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(pair.left, pair.left, cv::Size(5, 5), 1.2);
    pair.right = pair.left.clone();
    pair.left.colRange(shift, kWidth).copyTo(pair.right.colRange(0, kWidth - shift));
    random.fill(noise, cv::RNG::UNIFORM, 0, 12);
    pair.right += noise;
    return pair;
}

cv::Mat block_at(const cv::Mat &image, int x, int y, int width, int height)
{
    return image(cv::Rect(x - width / 2, y - height / 2, width, height));
}

double opencv_cost(match_method_t method, const cv::Mat &a, const cv::Mat &b)
{
    cv::Mat difference;
    cv::Mat result;
    switch (method) {
    case MATCH_SAD:
        cv::absdiff(a, b, difference);
        return cv::sum(difference)[0];
    case MATCH_SSD:
        return cv::norm(a, b, cv::NORM_L2SQR);
    case MATCH_CORR:
        return a.dot(b);
    case MATCH_NCC:
    default:
        cv::matchTemplate(a, b, result, cv::TM_CCORR_NORMED);
        return static_cast<double>(result.at<float>(0, 0)) * static_cast<double>(MATCH_NCC_ONE);
    }
}

// What the methods may differ by: nothing, but for the float of matchTemplate.
double tolerance(match_method_t method)
{
    return method == MATCH_NCC ? 1e-4 * static_cast<double>(MATCH_NCC_ONE) : 0.0;
}

// The extreme of matchTemplate along the search range: strip of the left image from disparity 0 on.
int opencv_disparity(match_method_t method, const Pair &pair, int x, int y, int width, int height)
{
    cv::Mat block = block_at(pair.right, x, y, width, height);
    cv::Mat strip = pair.left(cv::Rect(x - width / 2, y - height / 2, width + kSearch, height));
    cv::Mat result;
    cv::Point best;
    const int mode = method == MATCH_SSD    ? cv::TM_SQDIFF
                     : method == MATCH_CORR ? cv::TM_CCORR
                                            : cv::TM_CCORR_NORMED;
    cv::matchTemplate(strip, block, result, mode);
    cv::minMaxLoc(result, nullptr, nullptr, method == MATCH_SSD ? &best : nullptr,
                  method == MATCH_SSD ? nullptr : &best);
    return best.x;
}

int check_trial(cv::RNG &random, match_method_t method)
{
    const Pair pair = make_pair(random);
    const image_view_t left = view_of(pair.left);
    const image_view_t right = view_of(pair.right);
    const int width = random.uniform(4, 17);
    const int height = random.uniform(4, 17);
    const int x = random.uniform(width, kWidth - kSearch - width);
    const int y = random.uniform(height, kHeight - height);
    match_params_t params = {};
    match_t match = {};

    params.method = method;
    params.block_width = static_cast<uint8_t>(width);
    params.block_height = static_cast<uint8_t>(height);
    params.reference_is_right = 1;
    params.disparity_max = kSearch;
    if (match_find(&left, &right, x, y, &params, &match) != MATCH_OK) {
        std::printf("method %d: no match at (%d,%d) block %dx%d\n", method, x, y, width, height);
        return 1;
    }
    const cv::Mat block = block_at(pair.right, x, y, width, height);
    const cv::Mat found = block_at(pair.left, x + match.disparity, y, width, height);
    const double theirs = opencv_cost(method, found, block);
    if (std::fabs(theirs - static_cast<double>(match.cost)) > tolerance(method)) {
        std::printf("method %d: cost %u, OpenCV %.1f\n", method, match.cost, theirs);
        return 1;
    }
    if (method == MATCH_SAD)
        return 0; // matchTemplate has no SAD; its minimum is a Unity test
    const int their_disparity = opencv_disparity(method, pair, x, y, width, height);
    const cv::Mat their_block = block_at(pair.left, x + their_disparity, y, width, height);
    // Another place is right only if it is as good: a tie, or within matchTemplate's rounding.
    const double slack = method == MATCH_NCC ? tolerance(method) : 1e-5 * theirs + 0.5;
    if (their_disparity != match.disparity &&
        std::fabs(opencv_cost(method, their_block, block) - theirs) > slack) {
        std::printf("method %d: disparity %d, OpenCV %d\n", method, match.disparity,
                    their_disparity);
        return 1;
    }
    return 0;
}

} // namespace

int main()
{
    static const char *const names[] = {"SAD", "SSD", "CORR", "NCC"};
    cv::RNG random(20); // any seed; fixed so that a failure can be repeated
    int failures = 0;
    for (int method = MATCH_SAD; method <= MATCH_NCC; method++) {
        int differ = 0;
        for (int trial = 0; trial < kTrials; trial++)
            differ += check_trial(random, static_cast<match_method_t>(method));
        std::printf("%s: %d of %d matches differ from OpenCV\n", names[method], differ, kTrials);
        failures += differ;
    }
    return failures != 0;
}
