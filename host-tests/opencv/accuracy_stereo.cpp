// How good the dense maps are: the photographed pair aloe of Debian's opencv-doc, which has a
// ground truth, at the robot's width, beside OpenCV's StereoBM and StereoSGBM. Prints one table:
//
//   bad 1, bad 2   share of the pixels with a true disparity whose disparity is missing or off by
//                  more than 1 or 2 px
//   wrong 1        the same among those that have a disparity
//   density        share of the pixels with a true disparity that have one
//   of all         the same of the whole picture; the other columns are of the part in which all of
//                  these methods can search: OpenCV's leave out as many columns on the left as
//                  there are disparities
//
// Exits 1 if our block matching differs from StereoBM, whose row it must repeat.
#include "pictures.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

extern "C" {
#include "vision/dense_bm.h"
#include "vision/dense_filter.h"
}

namespace
{

constexpr int kDisparities = 80;
constexpr int kWidth = 320;
constexpr int kHeight = 277;
constexpr int kHalf = 4; // of the blocks of 8 and 9

struct Scene {
    cv::Mat left; // red, green, blue
    cv::Mat right;
    Pair grey;
    cv::Mat truth; // px at this size; 0 = not known
};

cv::Mat rgb_scaled(const std::string &path)
{
    cv::Mat rgb;
    cv::cvtColor(scaled(read_picture(path, cv::IMREAD_COLOR), {kWidth, kHeight}), rgb,
                 cv::COLOR_BGR2RGB);
    return rgb;
}

// The truth is given in whole pixels of the full size. A scaled pixel has the value at its centre:
// a mean over an edge would be a place where nothing is.
cv::Mat read_truth(const std::string &path)
{
    const cv::Mat full = read_picture(path, cv::IMREAD_GRAYSCALE);
    cv::Mat truth;
    cv::resize(full, truth, {kWidth, kHeight}, 0, 0, cv::INTER_NEAREST);
    truth.convertTo(truth, CV_32F, static_cast<double>(kWidth) / full.cols);
    return truth;
}

Scene read_scene()
{
    const std::string folder = STEREOSOT_ALOE;
    return {rgb_scaled(folder + "/aloeL.jpg"), rgb_scaled(folder + "/aloeR.jpg"),
            aloe({kWidth, kHeight}), read_truth(folder + "/aloeGT.png")};
}

struct Count {
    double known = 0;
    double found = 0;
    double off1 = 0;
    double off2 = 0;
};

Count count_in(cv::Rect part, const cv::Mat &map, const cv::Mat &truth)
{
    Count count;
    for (int y = part.y; y < part.y + part.height; y++)
        for (int x = part.x; x < part.x + part.width; x++) {
            if (truth.at<float>(y, x) <= 0)
                continue;
            count.known++;
            if (map.at<int16_t>(y, x) < 0)
                continue;
            const double error = std::fabs(map.at<int16_t>(y, x) / 16.0 - truth.at<float>(y, x));
            count.found++;
            count.off1 += error > 1;
            count.off2 += error > 2;
        }
    return count;
}

void print_row(const char *name, const cv::Mat &map, const cv::Mat &truth)
{
    const Count all = count_in({0, 0, kWidth, kHeight}, map, truth);
    const Count c = count_in(
        {kDisparities + kHalf, kHalf, kWidth - kDisparities - 2 * kHalf, kHeight - 2 * kHalf}, map,
        truth);
    const double missing = c.known - c.found;
    std::printf("%-34s %6.1f %6.1f %8.1f %8.1f %7.1f\n", name, 100 * (missing + c.off1) / c.known,
                100 * (missing + c.off2) / c.known, 100 * c.off1 / c.found, 100 * c.found / c.known,
                100 * all.found / all.known);
}

cv::Mat paper_map(const Scene &scene, match_method_t method, dense_color_t color, uint8_t block)
{
    const uint32_t size = kWidth * kHeight;
    const dense_params_t params = {method,
                                   static_cast<uint8_t>(DENSE_COLOR_PLANES(color)),
                                   color == DENSE_HSV,
                                   block,
                                   kDisparities,
                                   0};
    std::vector<uint8_t> bytes[2];
    dense_eye_t eyes[2];
    for (int eye = 0; eye < 2; eye++) {
        bytes[eye].resize(3 * size);
        uint8_t *planes[DENSE_MAX_PLANES] = {&bytes[eye][0], &bytes[eye][size],
                                             &bytes[eye][2 * size]};
        dense_planes((eye ? scene.right : scene.left).data, size, color, planes);
        eyes[eye] = {{planes[0], planes[1], planes[2]}, kWidth, kHeight, kWidth};
    }
    std::vector<uint32_t> work(dense_work_words(kWidth, &params));
    cv::Mat map(kHeight, kWidth, CV_16S);
    if (dense_map(&eyes[0], &eyes[1], &params, work.data(), static_cast<uint32_t>(work.size()),
                  map.ptr<int16_t>(), kWidth) != DENSE_OK)
        map.setTo(DENSE_INVALID_Q4);
    return map;
}

cv::Mat block_map(const Scene &scene, const bm_params_t &params)
{
    const dense_eye_t left = eye_of(scene.grey.left);
    const dense_eye_t right = eye_of(scene.grey.right);
    std::vector<uint32_t> work(bm_work_words(kWidth, kHeight, &params));
    cv::Mat map(kHeight, kWidth, CV_16S);
    if (bm_map(&left, &right, &params, work.data(), static_cast<uint32_t>(work.size()),
               map.ptr<int16_t>(), kWidth) != DENSE_OK)
        map.setTo(DENSE_INVALID_Q4);
    return map;
}

cv::Mat filtered(const cv::Mat &map)
{
    cv::Mat clean(map.size(), CV_16S);
    std::vector<uint32_t> work(DENSE_SPECKLE_WORDS(kWidth, kHeight));
    dense_median(map.ptr<int16_t>(), kWidth, kHeight, kWidth, clean.ptr<int16_t>(), kWidth);
    dense_speckles(clean.ptr<int16_t>(), kWidth, kHeight, kWidth, 40, 16, work.data());
    return clean;
}

void print_paper(const Scene &scene)
{
    static const char *const methods[] = {"sad", "ssd", "corr", "ncc"};
    static const char *const colors[] = {"grey", "rgb", "hsv"};
    for (const match_method_t method : {MATCH_SAD, MATCH_SSD, MATCH_NCC})
        for (const dense_color_t color : {DENSE_GREY, DENSE_RGB, DENSE_HSV}) {
            const std::string name =
                std::string("ours ") + methods[method] + " " + colors[color] + " 8x8 (the paper)";
            print_row(name.c_str(), paper_map(scene, method, color, 8), scene.truth);
        }
}

cv::Mat opencv_map(cv::StereoMatcher &matcher, const Pair &grey)
{
    cv::Mat map;
    matcher.compute(grey.left, grey.right, map);
    return map;
}

} // namespace

int main()
{
    const Scene scene = read_scene();
    bm_params_t checked = bm_defaults(9, kDisparities);
    checked.left_right_max = 1;
    cv::Ptr<cv::StereoBM> bm = cv::StereoBM::create(kDisparities, 9);
    cv::Ptr<cv::StereoSGBM> sgbm =
        cv::StereoSGBM::create(0, kDisparities, 5, 8 * 25, 32 * 25, 1, 63, 10);
    const cv::Mat ours = block_map(scene, bm_defaults(9, kDisparities));
    const cv::Mat theirs = opencv_map(*bm, scene.grey);

    std::printf("%-34s %6s %6s %8s %8s %7s\n", "aloe 320x277, 80 disparities, %", "bad 1", "bad 2",
                "wrong 1", "density", "of all");
    print_paper(scene);
    print_row("ours bm, block 9", ours, scene.truth);
    print_row("ours bm, left-right check", block_map(scene, checked), scene.truth);
    print_row("ours bm, median, speckles", filtered(ours), scene.truth);
    print_row("OpenCV StereoBM, block 9", theirs, scene.truth);
    print_row("OpenCV StereoSGBM, block 5", opencv_map(*sgbm, scene.grey), scene.truth);
    return cv::countNonZero(ours != theirs) != 0;
}
