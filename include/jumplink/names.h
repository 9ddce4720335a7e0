/* The link names of the float library.
 *
 * A public name that has to do with jl_real is linked under another name when
 * jl_real is float, so that a program built for one number type cannot be
 * linked with the library of the other: the linker names what is missing.
 */
#ifndef JL_NAMES_H
#define JL_NAMES_H

#include "config.h"

#if JL_REAL_FLOAT
#define jl_exp jl_exp_f32
#define jl_log jl_log_f32
#define jl_sincos jl_sincos_f32
#define jl_atan2 jl_atan2_f32
#define jl_sqrt jl_sqrt_f32

#define jl_mat_mul jl_mat_mul_f32
#define jl_mat_mul_t jl_mat_mul_t_f32
#define jl_mat_sandwich jl_mat_sandwich_f32
#define jl_mat_apply jl_mat_apply_f32
#define jl_mat_cholesky jl_mat_cholesky_f32
#define jl_mat_cholesky_solve jl_mat_cholesky_solve_f32
#define jl_mat_lower_solve jl_mat_lower_solve_f32
#define jl_mat_ud jl_mat_ud_f32
#define jl_mat_ud_product jl_mat_ud_product_f32
#define jl_mat_givens jl_mat_givens_f32
#define jl_mat_givens_fixed jl_mat_givens_fixed_f32
#define jl_givens jl_givens_f32
#define jl_mat_pack jl_mat_pack_f32
#define jl_mat_unpack jl_mat_unpack_f32
#define jl_vec_within jl_vec_within_f32
#define jl_mat_check_cov jl_mat_check_cov_f32

#define jl_mode_init jl_mode_init_f32
#define jl_mode_set jl_mode_set_f32
#define jl_mode_nonlinear jl_mode_nonlinear_f32
#define jl_mode_move jl_mode_move_f32
#define jl_mode_sense jl_mode_sense_f32
#define jl_mode_motion jl_mode_motion_f32
#define jl_motion_noises jl_motion_noises_f32
#define jl_motion_start jl_motion_start_f32
#define jl_chain_sojourn jl_chain_sojourn_f32
#define jl_chain_check jl_chain_check_f32

#define jl_cov_full jl_cov_full_f32
#define jl_cov_ud jl_cov_ud_f32
#define jl_kf_joseph jl_kf_joseph_f32
#define jl_kf_standard jl_kf_standard_f32
#define jl_kf_sqrt jl_kf_sqrt_f32
#define jl_kf_unscented jl_kf_unscented_f32
#define jl_kf_fixed jl_kf_fixed_f32
#define jl_kf_init jl_kf_init_f32
#define jl_kf_set jl_kf_set_f32
#define jl_kf_cov jl_kf_cov_f32
#define jl_kf_gate jl_kf_gate_f32
#define jl_kf_predict jl_kf_predict_f32
#define jl_kf_update jl_kf_update_f32
#define jl_kf_step jl_kf_step_f32

#define jl_imm_init jl_imm_init_f32
#define jl_imm_init_sizes jl_imm_init_sizes_f32
#define jl_imm_gate jl_imm_gate_f32
#define jl_imm_cov jl_imm_cov_f32
#define jl_imm_logmu jl_imm_logmu_f32
#define jl_imm_chain jl_imm_chain_f32
#define jl_imm_set jl_imm_set_f32
#define jl_imm_step jl_imm_step_f32
#define jl_imm_mix jl_imm_mix_f32
#define jl_imm_filter jl_imm_filter_f32
#define jl_imm_weigh jl_imm_weigh_f32
#define jl_imm_combine jl_imm_combine_f32
#define jl_imm_foresee jl_imm_foresee_f32
#define jl_imm_mix_mode jl_imm_mix_mode_f32
#define jl_imm_predict_mode jl_imm_predict_mode_f32
#define jl_imm_update_mode jl_imm_update_mode_f32
#define jl_imm_judge jl_imm_judge_f32

#define jl_cg_steady jl_cg_steady_f32
#define jl_cg_cov jl_cg_cov_f32
#define jl_cg_design jl_cg_design_f32
#define jl_cg_coupling_of jl_cg_coupling_of_f32
#define jl_cgimm_init jl_cgimm_init_f32
#define jl_cgimm_set jl_cgimm_set_f32
#define jl_cgimm_restart jl_cgimm_restart_f32
#define jl_cgimm_step jl_cgimm_step_f32
#define jl_cgimm_foresee jl_cgimm_foresee_f32
#define jl_cgimm_mix_mode jl_cgimm_mix_mode_f32
#define jl_cgimm_filter_mode jl_cgimm_filter_mode_f32
#define jl_cgimm_weigh jl_cgimm_weigh_f32
#define jl_cgimm_combine jl_cgimm_combine_f32
#define jl_cgimm_estimate jl_cgimm_estimate_f32
#define jl_cgimm_loglik jl_cgimm_loglik_f32
#define jl_cg_adaptive_init jl_cg_adaptive_init_f32
#define jl_cg_adaptive_set jl_cg_adaptive_set_f32
#define jl_cg_adaptive_step jl_cg_adaptive_step_f32

#define jl_mekf_init jl_mekf_init_f32
#define jl_mekf_set jl_mekf_set_f32
#define jl_mekf_step jl_mekf_step_f32
#define jl_mekf_cov jl_mekf_cov_f32
#define jl_ekf_init jl_ekf_init_f32
#define jl_ekf_set jl_ekf_set_f32
#define jl_ekf_step jl_ekf_step_f32

#define jl_systolic_init jl_systolic_init_f32
#define jl_systolic_step jl_systolic_step_f32
#define jl_systolic_cov jl_systolic_cov_f32

#define jl_put_real jl_put_real_f32
#define jl_get_real jl_get_real_f32
#define jl_put_reals jl_put_reals_f32
#define jl_get_reals jl_get_reals_f32

#define jl_host_ready jl_host_ready_f32
#define jl_host_send jl_host_send_f32
#define jl_host_recv jl_host_recv_f32
#define jl_host_stop jl_host_stop_f32
#define jl_par_deal jl_par_deal_f32
#define jl_par_init jl_par_init_f32
#define jl_par_init_cg jl_par_init_cg_f32
#define jl_par_serve jl_par_serve_f32
#define jl_par_step jl_par_step_f32
#define jl_par_ahead jl_par_ahead_f32
#define jl_fold_deal jl_fold_deal_f32
#define jl_fold_init jl_fold_init_f32
#define jl_fold_step jl_fold_step_f32
#define jl_fold_stop jl_fold_stop_f32
#endif

#endif
