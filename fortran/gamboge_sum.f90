! L5: long-range forces and potentials on the caller's own arrays x(2,n), x(3,n) or x(n), y(n), z(n)
! of any layout. Single-precision arguments, or separate arrays of different strides, cost a copy.
module gamboge_sum
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: gbg_e_order, gbg_ok, gbg_sum_create, gbg_sum_describe, &
      gbg_sum_destroy, gbg_sum_get_error, gbg_sum_get_forces, gbg_sum_get_potential, gbg_sum_run, &
      gbg_sum_set_option, gbg_sum_set_positions, gbg_sum_set_sources
   use gamboge_context, only: context_of, gbg_context_t
   use gamboge_layout, only: drop, match_size, points, put_back, take
   use gamboge_tools, only: buffer_text, c_text, context_handle, context_hold, context_release, &
      context_state, report, stop_copy, text_capacity
   implicit none
   private

   ! Not to be assigned or returned by a function.
   type, public :: gbg_sum_t
      private
      type(c_ptr) :: handle = c_null_ptr
      type(context_state), pointer :: context => null()
      integer :: axes = 0
      integer(int64) :: n = 0
   contains
      generic, public :: create => create64, create64_int64, create32
      procedure, public :: destroy => sum_destroy
      ! 'split', 'window', 'gradient', 'check', 'precision' or 'hurry', before the first run.
      procedure, public :: set_option => sum_set_option
      generic, public :: set_positions => set_matrix64, set_separate64, set_matrix32, set_separate32
      generic, public :: set_sources => sources64, sources32
      ! Sums; then the procedures below read the result.
      procedure, public :: run => sum_run
      generic, public :: get_forces => forces_matrix64, forces_separate64, forces_matrix32, &
         forces_separate32
      generic, public :: get_potential => potential64, potential32
      procedure, public :: get_error => sum_get_error
      procedure, public :: describe => sum_describe
      procedure, private :: create64, create64_int64, create32
      procedure, private :: set_matrix64, set_separate64, set_matrix32, set_separate32
      procedure, private :: sources64, sources32, potential64, potential32
      procedure, private :: forces_matrix64, forces_separate64, forces_matrix32, forces_separate32
      procedure, private :: copy => sum_copy
      generic, public :: assignment(=) => copy
      final :: sum_finalise
   end type gbg_sum_t

   character(*), parameter :: setting = 'gbg_sum_t%set_positions'
   character(*), parameter :: getting = 'gbg_sum_t%get_forces'

contains

   ! A solver for F_i = mobility_i sum over k of alpha_k r_ik/|r_ik|**(power+1), n particles in a
   ! periodic box of size(lengths) dimensions.
   subroutine create64_int64(self, context, lengths, power, n, kind, tolerance, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      ! box lengths, 2 or 3 of them [length]
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in) :: power
      ! particles
      integer(int64), intent(in) :: n
      ! 'lattice' (all images by a mesh; the default) or 'minimum_image' (nearest images, all pairs)
      character(*), intent(in), optional :: kind
      ! relative RMS error of the forces, up to 0.1; 1e-4 without it
      real(real64), intent(in), optional :: tolerance
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      character(:), allocatable :: name
      real(real64) :: error
      integer(c_int) :: status
      state => context_of(context)
      if (associated(self%context)) then
         call report(state, gbg_e_order, stat, errmsg, &
                     'gbg_sum_t%create: this sum exists already, destroy it first')
         return
      end if
      name = 'lattice'
      error = 0
      if (present(kind)) name = kind
      if (present(tolerance)) error = tolerance
      status = gbg_sum_create(context_handle(state), size(lengths), lengths, power, &
                              c_text(name), error, n, self%handle)
      if (status == gbg_ok) then
         call context_hold(state, self%context)
         self%axes = size(lengths)
         self%n = n
      end if
      call report(state, status, stat, errmsg)
   end subroutine create64_int64

   subroutine create64(self, context, lengths, power, n, kind, tolerance, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in) :: power
      integer(int32), intent(in) :: n
      character(*), intent(in), optional :: kind
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%create(context, lengths, power, int(n, int64), kind, tolerance, stat, errmsg)
   end subroutine create64

   subroutine create32(self, context, lengths, power, n, kind, tolerance, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: power
      integer(int32), intent(in) :: n
      character(*), intent(in), optional :: kind
      real(real32), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: error
      error = 0
      if (present(tolerance)) error = tolerance
      call self%create(context, real(lengths, real64), real(power, real64), int(n, int64), kind, &
                       error, stat, errmsg)
   end subroutine create32

   ! Twice is allowed.
   subroutine sum_destroy(self)
      class(gbg_sum_t), intent(inout) :: self
      integer(c_int) :: status
      status = gbg_sum_destroy(self%handle)
      call context_release(self%context)
      self%axes = 0
      self%n = 0
   end subroutine sum_destroy

   impure elemental subroutine sum_finalise(self)
      type(gbg_sum_t), intent(inout) :: self
      call sum_destroy(self)
   end subroutine sum_finalise

   subroutine sum_set_option(self, option, value, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      character(*), intent(in) :: option, value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_sum_set_option(self%handle, c_text(option), c_text(value)), &
                  stat, errmsg)
   end subroutine sum_set_option

   subroutine set_matrix64(self, x, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      ! x(2,n) or x(3,n) [length], any finite value, taken modulo the box; in two dimensions a third
      ! row is ignored
      real(real64), intent(in), target :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, setting, self%axes, x)
      call place(self, p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_matrix64

   subroutine set_separate64(self, x, y, z, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      real(real64), intent(in), target :: x(:), y(:)
      ! in three dimensions
      real(real64), intent(in), optional, target :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, setting, self%axes, x, y, z)
      call place(self, p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_separate64

   subroutine set_matrix32(self, x, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      real(real32), intent(in) :: x(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, setting, self%axes, x)
      call place(self, p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_matrix32

   subroutine set_separate32(self, x, y, z, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in), optional :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, setting, self%axes, x, y, z)
      call place(self, p)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine set_separate32

   subroutine place(self, p)
      class(gbg_sum_t), intent(inout) :: self
      type(points), intent(inout) :: p
      if (self%axes > 0) call match_size(p, setting, 'the sum', self%n)
      if (p%status == gbg_ok) p%status = gbg_sum_set_positions(self%handle, p%x, p%y, p%z, p%step)
      call drop(p)
   end subroutine place

   ! Source strength of each particle.
   subroutine sources64(self, alpha, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      real(real64), intent(in), contiguous :: alpha(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      p%n = self%n
      if (self%axes > 0) &
         call match_size(p, 'gbg_sum_t%set_sources', 'alpha', size(alpha, kind=int64))
      if (p%status == gbg_ok) p%status = gbg_sum_set_sources(self%handle, alpha)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine sources64

   subroutine sources32(self, alpha, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      real(real32), intent(in) :: alpha(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call self%set_sources(real(alpha, real64), stat, errmsg)
   end subroutine sources32

   subroutine sum_run(self, stat, errmsg)
      class(gbg_sum_t), intent(inout) :: self
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_sum_run(self%handle), stat, errmsg)
   end subroutine sum_run

   subroutine forces_matrix64(self, f, mobility, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      ! receives the forces, shape and layout of its own
      real(real64), intent(inout), target :: f(:, :)
      ! response of each particle; 1 without it
      real(real64), intent(in), optional, target, contiguous :: mobility(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, getting, self%axes, f)
      call read_forces(self, p, mobility)
      call put_back(p, f)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_matrix64

   subroutine forces_separate64(self, fx, fy, fz, mobility, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      real(real64), intent(inout), target :: fx(:), fy(:)
      ! in three dimensions
      real(real64), intent(inout), optional, target :: fz(:)
      real(real64), intent(in), optional, target, contiguous :: mobility(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, getting, self%axes, fx, fy, fz)
      call read_forces(self, p, mobility)
      call put_back(p, fx, fy, fz)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_separate64

   subroutine forces_matrix32(self, f, mobility, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      real(real32), intent(inout) :: f(:, :)
      real(real32), intent(in), optional :: mobility(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, getting, self%axes, f)
      call read_forces32(self, p, mobility)
      call put_back(p, f)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_matrix32

   subroutine forces_separate32(self, fx, fy, fz, mobility, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      real(real32), intent(inout) :: fx(:), fy(:)
      real(real32), intent(inout), optional :: fz(:)
      real(real32), intent(in), optional :: mobility(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, getting, self%axes, fx, fy, fz)
      call read_forces32(self, p, mobility)
      call put_back(p, fx, fy, fz)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine forces_separate32

   subroutine read_forces32(self, p, mobility)
      class(gbg_sum_t), intent(in) :: self
      type(points), intent(inout) :: p
      real(real32), intent(in), optional :: mobility(:)
      if (present(mobility)) then
         call read_forces(self, p, real(mobility, real64))
      else
         call read_forces(self, p)
      end if
   end subroutine read_forces32

   subroutine read_forces(self, p, mobility)
      class(gbg_sum_t), intent(in) :: self
      type(points), intent(inout) :: p
      real(real64), intent(in), optional, target, contiguous :: mobility(:)
      type(c_ptr) :: response
      response = c_null_ptr
      if (self%axes > 0) call match_size(p, getting, 'the sum', self%n)
      if (present(mobility)) then
         call match_size(p, getting, 'mobility', size(mobility, kind=int64))
         if (size(mobility) > 0) response = c_loc(mobility)
      end if
      if (p%status == gbg_ok) p%status = gbg_sum_get_forces(self%handle, response, p%x, p%y, p%z, &
                                                            p%step)
   end subroutine read_forces

   ! Potential at each particle, of sources of strength alpha; kind 'lattice' only.
   subroutine potential64(self, values, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      real(real64), intent(inout), contiguous :: values(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      p%n = self%n
      if (self%axes > 0) &
         call match_size(p, 'gbg_sum_t%get_potential', 'values', size(values, kind=int64))
      if (p%status == gbg_ok) p%status = gbg_sum_get_potential(self%handle, values)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine potential64

   subroutine potential32(self, values, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      real(real32), intent(inout) :: values(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), allocatable :: buffer(:)
      allocate (buffer(size(values)))
      buffer = values
      call self%get_potential(buffer, stat, errmsg)
      values = real(buffer, real32)
   end subroutine potential32

   ! Measured error of the forces, against a sum without a mesh or pair by pair in double precision.
   subroutine sum_get_error(self, rms_over_rms, rms_over_median, samples, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      ! RMS(dF)/RMS(F) and RMS(dF)/median|F|
      real(real64), intent(inout) :: rms_over_rms, rms_over_median
      ! particles to measure it on, 1000 without it
      integer, intent(in), optional :: samples
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int64_t) :: wanted
      wanted = 0
      if (present(samples)) wanted = samples
      call report(self%context, gbg_sum_get_error(self%handle, wanted, rms_over_rms, &
                                                  rms_over_median), stat, errmsg)
   end subroutine sum_get_error

   ! 'r/r^3, all images: reach 3.7, mesh 128x128, width 6, float, error 9.1e-05, 64 ns a particle'
   subroutine sum_describe(self, text, stat, errmsg)
      class(gbg_sum_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: text
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_sum_describe(self%handle, size(buffer, kind=int64), buffer)
      if (status == gbg_ok) text = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end subroutine sum_describe

   subroutine sum_copy(self, other)
      class(gbg_sum_t), intent(inout) :: self
      class(gbg_sum_t), intent(in) :: other
      if (associated(self%context) .or. associated(other%context)) call stop_copy('gbg_sum_t')
   end subroutine sum_copy
end module gamboge_sum
