! L5: the scene: what to simulate. Lengths, times and energies are in the user's own units.
! Species and forces count from 1. Single-precision arguments are copied to double precision.
! Interfaces here, bodies in gamboge_scene_calls.f90.
module gamboge_scene
   use, intrinsic :: iso_c_binding, only: c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_context, only: gbg_context_t
   use gamboge_tools, only: context_state
   implicit none
   private

   public :: gbg_scene_option
   ! For the modules of the other objects; not part of module gamboge.
   public :: scene_handle, scene_context

   ! Generic, since the C function has this name too.
   interface gbg_scene_option
      module procedure option_line
   end interface gbg_scene_option

   ! Not to be assigned or returned by a function.
   type, public :: gbg_scene_t
      private
      type(c_ptr) :: handle = c_null_ptr
      type(context_state), pointer :: context => null()
      integer :: axes = 0
   contains
      generic, public :: create => create_int32, create_int64
      procedure, public :: read => scene_read
      procedure, public :: destroy => scene_destroy
      ! One option by name; the type of the value must be that of the option.
      generic, public :: set => set_real64, set_real32, set_int32, set_int64, set_text, &
         set_logical
      generic, public :: get => get_real64, get_real32, get_int32, get_int64, get_text, &
         get_logical
      generic, public :: set_box => set_box64, set_box32
      generic, public :: get_box => get_box64, get_box32
      procedure, public :: dimension => scene_dimension
      generic, public :: add_species => add_fraction64, add_count64, add_count64_int64, &
         add_fraction32, add_count32
      generic, public :: add_force => add_force64, add_force32, add_force_int
      procedure, public :: set_force => scene_set_force
      procedure, public :: get_size => scene_get_size
      procedure, public :: get_species => scene_get_species
      procedure, public :: get_force => scene_get_force
      ! A block of particles from x(2,n), x(3,n) or from x(n), y(n), z(n), in any layout.
      generic, public :: add_particles => add_matrix64, add_separate64, add_matrix32, &
         add_separate32, add_matrix64_int64, add_separate64_int64
      procedure, public :: check => scene_check
      procedure, private :: create_int32, create_int64
      procedure, private :: set_real64, set_real32, set_int32, set_int64, set_text
      procedure, private :: set_logical, get_logical
      procedure, private :: get_real64, get_real32, get_int32, get_int64, get_text
      procedure, private :: set_box64, set_box32, get_box64, get_box32
      procedure, private :: add_fraction64, add_count64, add_count64_int64, add_fraction32, &
         add_count32
      procedure, private :: add_force64, add_force32, add_force_int
      procedure, private :: add_matrix64, add_separate64, add_matrix32, add_separate32, &
         add_matrix64_int64, add_separate64_int64
      procedure, private :: copy => scene_copy
      generic, public :: assignment(=) => copy
      final :: scene_finalise
   end type gbg_scene_t

   interface
      ! An empty scene.
      module subroutine create_int32(self, context, dimension, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         type(gbg_context_t), intent(in) :: context
         ! 2 or 3
         integer(int32), intent(in) :: dimension
         ! 0, or why the call was refused; without it a failure stops the program
         integer, intent(out), optional :: stat
         ! set to a whole sentence (as much as it holds) by a failure only
         character(*), intent(inout), optional :: errmsg
      end subroutine create_int32

      module subroutine create_int64(self, context, dimension, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         type(gbg_context_t), intent(in) :: context
         integer(int64), intent(in) :: dimension
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine create_int64

      ! A scene from a YAML file (docs/scene_reference.md).
      module subroutine scene_read(self, context, path, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         type(gbg_context_t), intent(in) :: context
         character(*), intent(in) :: path
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine scene_read

      ! Twice is allowed.
      module subroutine scene_destroy(self)
         class(gbg_scene_t), intent(inout) :: self
      end subroutine scene_destroy

      impure elemental module subroutine scene_finalise(self)
         type(gbg_scene_t), intent(inout) :: self
      end subroutine scene_finalise

      module subroutine set_real64(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         ! for instance 'dynamics.dt'; gbg_scene_option and docs/scene_reference.md list them all
         character(*), intent(in) :: option
         real(real64), intent(in) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_real64

      ! Mind that 0.01 in single precision is 0.00999999978: write 0.01_real64 or 0.01d0.
      module subroutine set_real32(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: option
         real(real32), intent(in) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_real32

      module subroutine set_int64(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: option
         integer(int64), intent(in) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_int64

      module subroutine set_int32(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: option
         integer(int32), intent(in) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_int32

      module subroutine set_text(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: option
         character(*), intent(in) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_text

      ! A switch: .true. or .false.
      module subroutine set_logical(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: option
         logical, intent(in) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_logical

      module subroutine get_real64(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         character(*), intent(in) :: option
         real(real64), intent(inout) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_real64

      module subroutine get_real32(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         character(*), intent(in) :: option
         real(real32), intent(inout) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_real32

      module subroutine get_int64(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         character(*), intent(in) :: option
         integer(int64), intent(inout) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_int64

      module subroutine get_int32(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         character(*), intent(in) :: option
         integer(int32), intent(inout) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_int32

      module subroutine get_text(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         character(*), intent(in) :: option
         character(:), allocatable, intent(inout) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_text

      module subroutine get_logical(self, option, value, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         character(*), intent(in) :: option
         logical, intent(inout) :: value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_logical

      ! The periodic box.
      module subroutine set_box64(self, lengths, origin, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         ! one an axis [length]
         real(real64), intent(in) :: lengths(:)
         ! lower corner [length], 0 without it
         real(real64), intent(in), optional :: origin(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_box64

      module subroutine set_box32(self, lengths, origin, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real32), intent(in) :: lengths(:)
         real(real32), intent(in), optional :: origin(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine set_box32

      ! Box lengths, and the lower corner.
      module subroutine get_box64(self, lengths, origin, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         ! one an axis [length]
         real(real64), intent(inout) :: lengths(:)
         real(real64), intent(inout), optional :: origin(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_box64

      module subroutine get_box32(self, lengths, origin, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         real(real32), intent(inout) :: lengths(:)
         real(real32), intent(inout), optional :: origin(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine get_box32

      ! 2 or 3; 0 before create.
      module pure integer function scene_dimension(self)
         class(gbg_scene_t), intent(in) :: self
      end function scene_dimension

      ! Adds a species. With a fraction of particles.count, or without fraction and count when the
      ! particles come from arrays or a file.
      module subroutine add_fraction64(self, name, diameter, alpha, mobility, fraction, species, &
         stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: name
         ! of the hard core [length]
         real(real64), intent(in) :: diameter
         ! source strength: F_i = mobility_i sum_k alpha_k ...
         real(real64), intent(in) :: alpha
         ! response to the field of the others
         real(real64), intent(in) :: mobility
         ! 0 to 1
         real(real64), intent(in), optional :: fraction
         ! receives the index of the species, from 1
         integer, intent(out), optional :: species
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_fraction64

      ! Adds a species with its number of particles.
      module subroutine add_count64(self, name, diameter, alpha, mobility, count, species, &
         stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: name
         real(real64), intent(in) :: diameter, alpha, mobility
         integer(int32), intent(in) :: count
         integer, intent(out), optional :: species
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_count64

      module subroutine add_count64_int64(self, name, diameter, alpha, mobility, count, species, &
         stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: name
         real(real64), intent(in) :: diameter, alpha, mobility
         integer(int64), intent(in) :: count
         integer, intent(out), optional :: species
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_count64_int64

      module subroutine add_fraction32(self, name, diameter, alpha, mobility, fraction, species, &
         stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: name
         real(real32), intent(in) :: diameter, alpha, mobility
         real(real32), intent(in), optional :: fraction
         integer, intent(out), optional :: species
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_fraction32

      module subroutine add_count32(self, name, diameter, alpha, mobility, count, species, &
         stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         character(*), intent(in) :: name
         real(real32), intent(in) :: diameter, alpha, mobility
         integer(int32), intent(in) :: count
         integer, intent(out), optional :: species
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_count32

      ! Adds the pair force F_i = mobility_i sum_k alpha_k r_ik / |r_ik|**(power+1).
      module subroutine add_force64(self, power, sum, cutoff, tolerance, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real64), intent(in) :: power
         ! 'lattice' (the default), 'minimum_image' or 'cutoff'
         character(*), intent(in), optional :: sum
         ! with sum 'cutoff' only [length]
         real(real64), intent(in), optional :: cutoff
         ! relative RMS error asked for; 0 or absent: the default
         real(real64), intent(in), optional :: tolerance
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_force64

      module subroutine add_force32(self, power, sum, cutoff, tolerance, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real32), intent(in) :: power
         character(*), intent(in), optional :: sum
         real(real32), intent(in), optional :: cutoff, tolerance
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_force32

      module subroutine add_force_int(self, power, sum, cutoff, tolerance, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         integer(int32), intent(in) :: power
         character(*), intent(in), optional :: sum
         real(real64), intent(in), optional :: cutoff, tolerance
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_force_int

      ! Another key of a force that was added, as in scene files: 'split', 'window', 'gradient',
      ! 'check', 'tolerance', ...
      module subroutine scene_set_force(self, force, option, value, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         ! from 1
         integer, intent(in) :: force
         character(*), intent(in) :: option, value
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine scene_set_force

      ! How many species and forces the scene holds.
      module subroutine scene_get_size(self, n_species, n_forces, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         integer, intent(inout), optional :: n_species, n_forces
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine scene_get_size

      ! One species of the scene.
      module subroutine scene_get_species(self, species, name, diameter, alpha, mobility, count, &
         stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         ! from 1
         integer, intent(in) :: species
         character(:), allocatable, intent(inout), optional :: name
         real(real64), intent(inout), optional :: diameter, alpha, mobility
         ! particles of the species, -1 while it is not known
         integer(int64), intent(inout), optional :: count
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine scene_get_species

      ! One force of the scene.
      module subroutine scene_get_force(self, force, power, sum, cutoff, tolerance, stat, errmsg)
         class(gbg_scene_t), intent(in) :: self
         ! from 1
         integer, intent(in) :: force
         real(real64), intent(inout), optional :: power
         character(:), allocatable, intent(inout), optional :: sum
         ! [length], 0: none
         real(real64), intent(inout), optional :: cutoff
         real(real64), intent(inout), optional :: tolerance
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine scene_get_force

      ! Adds n = size(x, 2) particles; may be called again. In 2D a third row is ignored.
      module subroutine add_matrix64(self, x, species, ids, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         ! x(2,n) or x(3,n) [length]; any finite value, wrapped into the box
         real(real64), intent(in), target :: x(:, :)
         ! of each particle, from 1; all the first without it
         integer(int32), intent(in), optional, target :: species(:)
         ! permanent and distinct, from 0; the next free ones without them
         integer(int64), intent(in), optional, target :: ids(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_matrix64

      ! The same from separate arrays. They are copied only if their strides differ.
      module subroutine add_separate64(self, x, y, z, species, ids, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         ! coordinates [length]
         real(real64), intent(in), target :: x(:), y(:)
         ! ignored in two dimensions
         real(real64), intent(in), optional, target :: z(:)
         integer(int32), intent(in), optional, target :: species(:)
         integer(int64), intent(in), optional, target :: ids(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_separate64

      module subroutine add_matrix32(self, x, species, ids, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real32), intent(in) :: x(:, :)
         integer(int32), intent(in), optional, target :: species(:)
         integer(int64), intent(in), optional, target :: ids(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_matrix32

      module subroutine add_separate32(self, x, y, z, species, ids, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real32), intent(in) :: x(:), y(:)
         real(real32), intent(in), optional :: z(:)
         integer(int32), intent(in), optional, target :: species(:)
         integer(int64), intent(in), optional, target :: ids(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_separate32

      ! For codes built with -fdefault-integer-8.
      module subroutine add_matrix64_int64(self, x, species, ids, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real64), intent(in), target :: x(:, :)
         integer(int64), intent(in) :: species(:)
         integer(int64), intent(in), optional, target :: ids(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_matrix64_int64

      module subroutine add_separate64_int64(self, x, y, z, species, ids, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         real(real64), intent(in), target :: x(:), y(:)
         real(real64), intent(in), optional, target :: z(:)
         integer(int64), intent(in) :: species(:)
         integer(int64), intent(in), optional, target :: ids(:)
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine add_separate64_int64

      ! Checks the scene as a whole.
      module subroutine scene_check(self, stat, errmsg)
         class(gbg_scene_t), intent(inout) :: self
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine scene_check

      ! An entry of the option table: 'name|type|default|range|meaning';
      ! gbg_e_argument past its end.
      module subroutine option_line(index, line, stat, errmsg)
         ! from 1
         integer, intent(in) :: index
         character(:), allocatable, intent(inout) :: line
         integer, intent(out), optional :: stat
         character(*), intent(inout), optional :: errmsg
      end subroutine option_line

      module subroutine scene_copy(self, other)
         class(gbg_scene_t), intent(inout) :: self
         class(gbg_scene_t), intent(in) :: other
      end subroutine scene_copy

      module function scene_handle(scene) result(handle)
         type(gbg_scene_t), intent(in) :: scene
         type(c_ptr) :: handle
      end function scene_handle

      module function scene_context(scene) result(context)
         type(gbg_scene_t), intent(in) :: scene
         type(context_state), pointer :: context
      end function scene_context
   end interface
end module gamboge_scene
