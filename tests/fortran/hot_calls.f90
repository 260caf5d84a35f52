! The calls of an inner loop, for -Warray-temporaries -Werror: the compiler may make no copy of an
! array here. Compiled only.
subroutine hot_calls(context, engine, trajectory, analysis, x, rx, ry, rz, f, fx, fy, fz, alpha, n)
   use, intrinsic :: iso_fortran_env, only: real64
   use gamboge
   implicit none
   type(gbg_context_t), intent(in) :: context
   type(gbg_engine_t), intent(inout) :: engine
   type(gbg_trajectory_t), intent(inout) :: trajectory
   type(gbg_analysis_t), intent(inout) :: analysis
   integer, intent(in) :: n
   real(real64), intent(inout) :: x(3, n), rx(n), ry(n), rz(n), f(3, n), fx(n), fy(n), fz(n)
   real(real64), intent(in) :: alpha(n)
   real(real64) :: box(3)
   integer :: count
   box = 10
   call engine%run(1)
   call engine%get_positions(x)
   call engine%get_positions(x(:, 1:n:2))
   call engine%get_positions(x(1:2, n:1:-1))
   call engine%get_positions(rx, ry, rz)
   call engine%get_positions(x(1, :), x(2, :), x(3, :))
   call engine%get_forces(f)
   call engine%get_forces(fx, fy, fz)
   call engine%set_positions(x)
   call trajectory%get_positions(1, x)
   call trajectory%append(engine)
   call analysis%add_frame(x)
   call analysis%add_frame(rx, ry, rz)
   call gbg_pair_forces(context, box, 2.0_real64, x, alpha, alpha, f)
   call gbg_pair_forces(context, box, 2.0_real64, rx, ry, rz, alpha, alpha, fx, fy, fz)
   call gbg_pair_forces(context, box(:2), 2.0_real64, x(1:2, :), alpha, alpha, f)
   call gbg_overlaps_find(context, box, x, alpha, count)
   call gbg_overlaps_remove(context, box, rx, ry, rz, alpha)
   call gbg_normals(context, 1, 0, 0, 0, f)
end subroutine hot_calls
